"""Nodal images: captures seen from the projector, as reflectance factors of what each pixel lights (paper: IV-B).

Pure functions of captures and lookup tables; which captures there are stands in ``captures/exposures.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from paxel_runtime.captures.exposures import exposure_name, guide_channel
from paxel_runtime.errors import CalibrationError
from paxel_runtime.registration import ChannelRegistration, warp_to_nodal

__all__ = ["Captures", "Normalise", "nodal_reflectance", "nodal_to_linear_sRGB", "pattern_area", "reflectance_picture"]

Captures = Callable[[str], NDArray[np.uint16]]

Normalise = Literal["white", "paper", "field"]
"""What a nodal image is divided by: the second surface, the white paper, or its own light over many dots."""

_DARKEST = 0.01
"""Share of the brightest light below which a normalising picture tells nothing."""

_FIELD_SIGMA_DOTS = 6.0
_FIELD_TOP = 0.99
_RGB = ("red", "green", "blue")


def nodal_reflectance(
    captures: Captures,
    channels: tuple[str, ...],
    registration: Mapping[str, ChannelRegistration],
    *,
    normalise: Normalise = "white",
    dot_px: float = 5.0,
) -> NDArray[np.float32]:
    """Nodal images, black-subtracted and normalised, (H, W, N) float32, NaN where unknown (paper: IV-B).

    One plane a channel of the projector, through that channel's own lookup table. Where the projector lacks red, green
    or blue (one UV channel on fluorescent inks), the three planes of the camera under full light instead, through the
    guide channel's table.

    Parameters
    ----------
    normalise : "white" | "paper" | "field"
        ``"field"`` is for light under which white paper does not shine (UV): each plane is divided by its own light
        averaged over some dots, and scaled so that the brightest hundredth is 1. It removes vignetting as the paper
        does, but not an uneven print.
    dot_px : float
        Edge of a dot in projector pixels; for ``"field"`` only.
    """
    if set(_RGB) <= set(channels):
        pictures = [
            (_one_plane(captures, "pattern", name, channels), _one_plane(captures, normalise, name, channels), name)
            for name in channels
        ]
        nodal = [
            _normalised(on_pattern, on_reference, registration[name], dot_px)
            for on_pattern, on_reference, name in pictures
        ]
        return np.concatenate(nodal, axis=-1)
    guide = registration[guide_channel(channels)]
    return _normalised(_planes(captures, "pattern"), _planes(captures, normalise), guide, dot_px)


def nodal_to_linear_sRGB(nodal: NDArray[np.float32], channels: tuple[str, ...]) -> NDArray[np.float32]:
    """Nodal images as colours, (H, W, 3): the camera's values taken as sRGB (paper: IV-C2).

    Of a projector with red, green and blue its planes of these names; further channels add nothing. Of another one
    the nodal images are the camera's planes already, see `nodal_reflectance`.
    """
    if set(_RGB) <= set(channels):
        return nodal[..., [channels.index(name) for name in _RGB]]
    return nodal


def reflectance_picture(
    captures: Captures, reference: Normalise, dot_camera_px: float | None = None
) -> NDArray[np.float32]:
    """The print under full light over the white sheet under the same light, in the camera's raster, (h, w, 3) float32.

    Black-subtracted; 1 on bare paper, NaN where there is too little light to tell. With ``"field"`` each plane over its
    own light averaged over some dots, as in `nodal_reflectance`; then `dot_camera_px` must be given, the edge of a dot
    in the camera's picture.
    """
    light = _planes(captures, "pattern")
    if reference == "field":
        assert light is not None
        assert dot_camera_px is not None
        lit = np.ones(light.shape[:2], bool)
        return np.stack([_over_own_field(plane, lit, dot_camera_px) for plane in np.moveaxis(light, -1, 0)], axis=-1)
    return _over(light, _planes(captures, reference))


def pattern_area(ink: NDArray[np.bool_], dot_px: float) -> NDArray[np.bool_]:
    """Projector pixels inside the printed area: what a disc of 1.5 dots that touches no ink cannot cover.

    Beside the pattern lies bare paper, which would be taken for its white dots. The area is found to about half a dot.

    Parameters
    ----------
    ink : (H, W) bool array
        Pixels that light any colorant but the paper.
    dot_px : float
        Edge of a dot in projector pixels.

    Raises
    ------
    CalibrationError
        If there is no ink at all.
    """
    if not ink.any():
        raise CalibrationError(
            "no projector pixel lights an inked dot: is the pattern under the projection, and in focus? "
            "Then run: paxel capture --force"
        )
    radius_px = 1.5 * dot_px
    near_ink = distance_transform_edt(~ink) <= radius_px
    if near_ink.all():
        return near_ink
    return np.asarray(distance_transform_edt(near_ink) > radius_px)


def _one_plane(captures: Captures, surface: str, channel: str, channels: tuple[str, ...]) -> NDArray[np.float32] | None:
    """Light of one channel on a surface, (h, w, 1); None for the normalisation that needs no other picture."""
    if surface == "field":
        return None
    full = captures(exposure_name(surface, "full", channel, channels)).astype(np.float32)
    return (full - captures(exposure_name(surface, "dark", channel, channels)))[..., None]


def _planes(captures: Captures, surface: str) -> NDArray[np.float32] | None:
    """Full light on a surface in all planes of the camera, (h, w, 3)."""
    if surface == "field":
        return None
    return captures(f"{surface}-white").astype(np.float32) - captures(f"{surface}-black")


def _normalised(
    on_pattern: NDArray[np.float32] | None,
    on_reference: NDArray[np.float32] | None,
    table: ChannelRegistration,
    dot_px: float,
) -> NDArray[np.float32]:
    assert on_pattern is not None
    nodal = warp_to_nodal(on_pattern, table.camera_xy)
    if on_reference is not None:
        return _over(nodal, warp_to_nodal(on_reference, table.camera_xy))
    return np.stack([_over_own_field(plane, table.valid, dot_px) for plane in np.moveaxis(nodal, -1, 0)], axis=-1)


def _over(light: NDArray[np.float32] | None, reference: NDArray[np.float32] | None) -> NDArray[np.float32]:
    assert light is not None
    assert reference is not None
    floor = _DARKEST * float(np.nanmax(reference))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(reference > floor, light / reference, np.nan).astype(np.float32)


def _over_own_field(plane: NDArray[np.float32], valid: NDArray[np.bool_], dot_px: float) -> NDArray[np.float32]:
    """A plane over its mean within some dots, the brightest hundredth at 1."""
    seen = valid & np.isfinite(plane)
    sigma_px = _FIELD_SIGMA_DOTS * dot_px
    mean = gaussian_filter(np.where(seen, plane, 0), sigma_px) / np.maximum(
        gaussian_filter(seen.astype(np.float32), sigma_px), 1e-3
    )
    relative = np.where(seen & (mean > _DARKEST * mean.max()), plane / np.maximum(mean, 1e-9), np.nan)
    return (relative / np.nanquantile(relative, _FIELD_TOP)).astype(np.float32)
