"""All figures of one view, as they stand in ``preview/<name>.json``: a list over the parts that compute them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.observer.contrast import coherent_gain, lightness_range, local_contrast
from paxel_runtime.observer.eye import Viewer
from paxel_runtime.observer.ghosting import ghosting_percent, picture_correlation
from paxel_runtime.observer.smoothing import local_deviation
from paxel_runtime.observer.texture import texture_ghost_percent

__all__ = ["view_figures"]


def view_figures(
    Lab_view: NDArray[np.floating],
    Lab_mapped: NDArray[np.floating],
    Lab_other: NDArray[np.floating] | None,
    Lab_source: NDArray[np.floating] | None,
    inner: NDArray[np.bool_],
    viewer: Viewer,
    window_px: float,
) -> dict[str, Any]:
    """How well a view shows its mapped picture and the source, and how much of the other picture is left in it.

    Parameters
    ----------
    Lab_view, Lab_mapped : (H, W, 3) arrays
        The view, and the mapped picture of its surface; all through the viewer's eye (`view_to_Lab`,
        `picture_to_Lab`).
    Lab_other : (H, W, 3) array or None
        Mapped picture of the other surface, which may ghost; None where there is none.
    Lab_source : (H, W, 3) array or None
        The picture before gamut mapping; None where the surface has none.
    inner : (H, W) bool array
        Pixels that count, `inner_mask`.
    viewer : Viewer
    window_px : float
        Of the dots' texture, `texture_window_px`.

    Returns
    -------
    dict
        ``dE00_mean``, ``dE00_p95``, ``dE00_rms`` to the mapped picture; ``source_dE00_mean``, ``source_dE00_p95``;
        ``ghosting_percent`` and ``ghosting_fine_percent`` (above 1 cycle per degree), ``pictures_correlation``;
        ``texture_L`` (rms) and ``texture_ghost_percent``; ``coherent_gain``; ``local_contrast_L`` and
        ``local_contrast_kept`` (over the source's); ``L_range`` and ``L_range_mapped``; ``chroma_mean``,
        ``chroma_mean_mapped`` and ``chroma_max``. None where a figure has no meaning.

    Raises
    ------
    InputError
        If shapes differ or no pixel counts.
    """
    for name, Lab in (("mapped picture", Lab_mapped), ("other picture", Lab_other), ("source", Lab_source)):
        if Lab is not None and Lab.shape != Lab_view.shape:
            raise InputError(f"{name} must have the view's shape {Lab_view.shape}, got {Lab.shape}")
    if inner.shape != Lab_view.shape[:2] or not inner.any():
        raise InputError(f"inner must be a mask {Lab_view.shape[:2]} with pixels in it, got {inner.shape}")
    L_view, L_own = Lab_view[..., 0], Lab_mapped[..., 0]
    dE = dE00(Lab_view[inner], Lab_mapped[inner])
    contrast_L = local_contrast(L_view, inner, viewer.px_per_degree)
    chroma = np.hypot(Lab_view[inner][:, 1], Lab_view[inner][:, 2])
    chroma_mapped = np.hypot(Lab_mapped[inner][:, 1], Lab_mapped[inner][:, 2])
    figures: dict[str, Any] = {
        "dE00_mean": float(np.mean(dE)),
        "dE00_p95": float(np.quantile(dE, 0.95)),
        "dE00_rms": float(np.sqrt(np.mean(np.square(dE)))),
        "source_dE00_mean": None,
        "source_dE00_p95": None,
        "ghosting_percent": None,
        "ghosting_fine_percent": None,
        "pictures_correlation": None,
        "texture_L": float(np.sqrt(np.mean(local_deviation(L_view - L_own, inner, window_px)[inner] ** 2))),
        "texture_ghost_percent": None,
        "coherent_gain": coherent_gain(L_view, L_own, inner),
        "local_contrast_L": contrast_L,
        "local_contrast_kept": None,
        "L_range": lightness_range(L_view, inner),
        "L_range_mapped": lightness_range(L_own, inner),
        "chroma_mean": float(np.mean(chroma)),
        "chroma_mean_mapped": float(np.mean(chroma_mapped)),
        "chroma_max": float(np.max(chroma)),
    }
    if Lab_other is not None:
        L_other = Lab_other[..., 0]
        figures |= {
            "ghosting_percent": ghosting_percent(L_view, L_own, L_other, inner),
            "ghosting_fine_percent": ghosting_percent(L_view, L_own, L_other, inner, viewer.px_per_degree),
            "pictures_correlation": picture_correlation(L_own, L_other, inner),
            "texture_ghost_percent": texture_ghost_percent(L_view, L_own, L_other, inner, window_px),
        }
    if Lab_source is not None:
        dE_source = dE00(Lab_view[inner], Lab_source[inner])
        source_L = local_contrast(Lab_source[..., 0], inner, viewer.px_per_degree)
        figures |= {
            "source_dE00_mean": float(np.mean(dE_source)),
            "source_dE00_p95": float(np.quantile(dE_source, 0.95)),
            "local_contrast_kept": contrast_L / source_L if source_L > 1e-3 else None,
        }
    return figures
