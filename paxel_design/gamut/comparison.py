"""Gamuts side by side: what two bodies of colours share, and the RGB spaces that others publish.

Bodies are compared by their CIELAB numbers, each under its own white, as pictures are (design: section 4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.meshes import GamutMesh, gamut_mesh, gamut_solid, mesh_of_solid
from paxel_design.gamut.polytopes import zonotope_half_spaces
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.subgamut import SubGamut

__all__ = ["RGB_SPACES", "coverage", "intersection", "mesh_of_arrays", "rgb_primaries", "rgb_space"]

_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_D50 = (0.3457, 0.3585)


@dataclass(frozen=True)
class _RGBSpace:
    """Chromaticities (x, y) of red, green, blue and white."""

    primaries: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    white: tuple[float, float]


RGB_SPACES: dict[str, _RGBSpace] = {
    "srgb": _RGBSpace(((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), (0.3127, 0.3290)),
    "dci-p3": _RGBSpace(((0.680, 0.320), (0.265, 0.690), (0.150, 0.060)), (0.314, 0.351)),
    "rec2020": _RGBSpace(((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), (0.3127, 0.3290)),
}
"""By name: IEC 61966-2-1, SMPTE RP 431-2 with its own white, ITU-R BT.2020."""


def rgb_space(name: str, *, under_D50: bool = False) -> SubGamut:
    """The colours of an RGB space, as a sub-gamut of no pattern.

    Parameters
    ----------
    name : str
        A key of `RGB_SPACES`.
    under_D50 : bool
        Adapt it to D50 by Bradford's transform, as ICC profiles and the volumes published of them do.

    Raises
    ------
    InputError
        If the name is not in the table.
    """
    primaries, white_point = rgb_primaries(name, under_D50=under_D50)
    return SubGamut(name, "pattern", *zonotope_half_spaces(primaries, np.zeros(3)), white_point)


def rgb_primaries(name: str, *, under_D50: bool = False) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """XYZ of red, green and blue at full as columns (3, 3), and of their white (3,), Y = 1; as `rgb_space` takes them.

    Raises
    ------
    InputError
        If the name is not in the table.
    """
    if name not in RGB_SPACES:
        raise InputError(f"an RGB space must be one of {', '.join(RGB_SPACES)}; got {name!r}")
    space = RGB_SPACES[name]
    primaries, white_point = _xy_to_XYZ(np.array(space.primaries)).T, _xy_to_XYZ(np.array(space.white))
    generators = primaries * np.linalg.solve(primaries, white_point)
    if under_D50:
        to_D50 = _xy_to_XYZ(np.array(_D50))
        gain = (_BRADFORD @ to_D50) / (_BRADFORD @ white_point)
        generators, white_point = np.linalg.solve(_BRADFORD, gain[:, None] * (_BRADFORD @ generators)), to_D50
    return generators, white_point


def intersection(first: GamutMesh, second: GamutMesh) -> GamutMesh:
    """What two bodies share.

    Raises
    ------
    GamutError
        If they share no volume.
    """
    return mesh_of_solid(gamut_solid(first) ^ gamut_solid(second))


def coverage(gamut: GamutMesh, reference: GamutMesh | str) -> float:
    """Share (0..1) of the volume of `reference`, a mesh or a key of `RGB_SPACES`, that lies in `gamut`."""
    body = gamut_mesh(rgb_space(reference)) if isinstance(reference, str) else reference
    try:
        return intersection(gamut, body).mesh_volume / body.mesh_volume
    except GamutError:
        return 0.0


def mesh_of_arrays(arrays: Mapping[str, NDArray[Any]], source: str) -> GamutMesh:
    """The mesh that the arrays of a sub-gamut's ``.npz`` hold; its volume is that of its triangles.

    Raises
    ------
    InputError
        If there is no mesh in them, or it does not close.
    """
    if "Lab" not in arrays or "faces" not in arrays:
        raise InputError(f"{source} must hold the mesh of a sub-gamut (arrays Lab and faces), got {', '.join(arrays)}")
    Lab, faces = np.asarray(arrays["Lab"], np.float64), np.asarray(arrays["faces"], np.int64)
    if Lab.ndim != 2 or Lab.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not np.all(np.isfinite(Lab)):
        raise InputError(f"{source} must hold finite Lab (V, 3) and faces (F, 3), got {Lab.shape} and {faces.shape}")
    if faces.min(initial=0) < 0 or faces.max(initial=0) >= len(Lab):
        raise InputError(f"{source}: faces must be numbers of vertices, 0 to {len(Lab) - 1}")
    try:
        return mesh_of_solid(gamut_solid(GamutMesh(Lab, faces, 0.0, 0.0, 0.0, 1, 0)))
    except GamutError as error:
        raise InputError(f"{source}: {error}") from error


def _xy_to_XYZ(xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """XYZ with Y = 1 of chromaticities (..., 2)."""
    x, y = xy[..., 0], xy[..., 1]
    return np.stack((x / y, np.ones_like(x), (1 - x - y) / y), axis=-1)
