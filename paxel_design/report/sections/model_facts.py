"""What the model itself says: its inputs, its black level, and the light of each cluster alone."""

from __future__ import annotations

import numpy as np

from paxel_design.report.content import Heading, Paragraph, Quantity, Table
from paxel_design.report.sections.parts import Part, on_the_bench
from paxel_design.report.source import ReportSource
from paxel_runtime.model.colorimetry import XYZ_to_Lab

__all__ = ["model_facts"]

_SURFACES = {"pattern": "pattern", "white": "white surface"}


def model_facts(source: ReportSource) -> Part:
    """Computed from model.json, as linear light."""
    model = source.model.linear
    N, K = len(model.channels), len(model.clusters)
    words = "computed from A and black of model.json, to a hundredth"
    quantities: dict[str, Quantity] = {
        "calibration.model.inputs": Quantity(model.n, "inputs", "channels times clusters of model.json"),
        "calibration.model.channels": Quantity(model.channels, "", "channels of model.json"),
        "calibration.model.clusters": Quantity(model.clusters, "", "clusters of model.json"),
    }
    lit = {name: np.repeat(np.eye(K)[i], N) for i, name in enumerate(model.clusters)}
    lit = {"all": np.ones(model.n), **lit, "black level": np.zeros(model.n)}
    for surface, optics in model.surfaces.items():
        A, black = _mean_over_pixels(optics.A, 2), _mean_over_pixels(optics.black, 1)
        for name, x in lit.items():
            L, a, b = XYZ_to_Lab(A @ x + black, model.white_point)
            key = f"calibration.model.{surface}.{name.replace(' ', '-')}"
            quantities[f"{key}.L"] = Quantity(round(float(L), 2), "L*", words)
            quantities[f"{key}.chroma"] = Quantity(round(float(np.hypot(a, b)), 2), "C*", words)
    header = ("lit at full", *(f"{_SURFACES[s]}: {w}" for s in model.surfaces for w in ("L*", "C*")))
    rows = tuple(
        (
            {"all": "all clusters", "black level": "nothing (black level)"}.get(name, f"cluster {name}"),
            *(
                f"{{calibration.model.{surface}.{name.replace(' ', '-')}.{figure}}}"
                for surface in model.surfaces
                for figure in ("L", "chroma")
            ),
        )
        for name in lit
    )
    corrected = (
        "A measured correction for what light does beyond that is used to predict and to polish."
        if source.model.correction is not None
        else "It has no correction: light is taken to add up."
    )
    text = (
        "The model has {calibration.model.inputs} inputs: channels {calibration.model.channels} on clusters "
        f"{{calibration.model.clusters}}. {corrected}"
    )
    caption = f"What each cluster shows alone under all channels, under full white{on_the_bench(source)}."
    return Part([Heading("The model"), Paragraph(text), Table("calibration-model", caption, header, rows)], quantities)


def _mean_over_pixels(values: np.ndarray, axes: int) -> np.ndarray:
    """Of an image-based model, the mean over its pixels; a spectral one has no pixels."""
    return np.asarray(values, np.float64).reshape(-1, *values.shape[-axes:]).mean(axis=0)
