"""The viewer: what the eye sees of a view from its distance, and the figures of it (design: sections 4 and 10)."""

from paxel_runtime.observer.view import EYE_SIGMA_ARCMIN, eye_blur, eye_sigma_mm, view_figures, view_to_sRGB

__all__ = ["EYE_SIGMA_ARCMIN", "eye_blur", "eye_sigma_mm", "view_figures", "view_to_sRGB"]
