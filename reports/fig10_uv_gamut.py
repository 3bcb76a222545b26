"""Fig. 10: the gamut of one ultraviolet channel on fluorescent inks beside that of a video projector on white paper.

Both stand under the video projector's white and have the same luminance at full, so that only colour is compared. The
video projector's gamut is read from the b/w installation's white sheet: its clusters together are the whole projector.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from paxel_design.gamut import JointGamut, coverage, subgamut_and_mesh
from paxel_design.gamut.scenes import SceneBody, write_scene
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.effects import Full
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.storage import load_model
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import shared

ITEM = Item(
    "fig10_uv_gamut",
    "Fig. 10",
    "the UV gamut reaches brighter colours than the video projector's; red is not as saturated, which makes it narrow",
    ("uv-rgb", "bw-checkerboard"),
)


def make(run: Run) -> Result:
    """Volumes, the brightest saturated colours, and the picture."""
    print_model = load_model(shared("bw-checkerboard", run.quick).folder("calibration") / "model.json")
    uv_model = load_model(shared("uv-rgb", run.quick).folder("calibration") / "model.json")
    video, ultraviolet = video_projector(print_model), under_white_of(uv_model, print_model)
    bodies = [subgamut_and_mesh(JointGamut(model), Full(), "pattern")[1] for model in (video, ultraviolet)]
    scene = [SceneBody(bodies[0], "video projector on white paper"), SceneBody(bodies[1], "ultraviolet")]
    write_scene(run.folder / f"{ITEM.name}.png", scene, size_px=(900, 750))
    volumes = [body.volume for body in bodies]
    shared_part = coverage(bodies[0], bodies[1])
    blue = [primaries(model)[-1] for model in (video, ultraviolet)]
    red = [primaries(model)[0] for model in (video, ultraviolet)]
    figures = {
        "L* of blue, video projector": Figure(blue[0][0], "L*", "CIELAB"),
        "L* of blue, ultraviolet": Figure(blue[1][0], "L*", "CIELAB"),
        "chroma of red, video projector": Figure(np.hypot(*red[0][1:]), "CIELAB", "CIELAB"),
        "chroma of red, ultraviolet": Figure(np.hypot(*red[1][1:]), "CIELAB", "CIELAB"),
        "video projector, volume": Figure(volumes[0], "CIELAB^3", "volume"),
        "ultraviolet, volume": Figure(volumes[1], "CIELAB^3", "volume"),
        "ultraviolet / video projector": Figure(volumes[1] / volumes[0], "", "ratio"),
        "share of the UV gamut that the video projector has too": Figure(shared_part, "", "share"),
    }
    relations = {
        "the UV gamut is smaller": volumes[1] < volumes[0],
        "the UV gamut's blue is brighter, as the paper saw": blue[1][0] > blue[0][0],
        "the UV gamut's red is less saturated, as the paper saw": np.hypot(*red[1][1:]) < np.hypot(*red[0][1:]),
    }
    sizes = " against ".join(f"{volume:,.0f}".replace(",", " ") for volume in volumes[::-1])
    inside = f"{100 * shared_part:.0f} % of it inside the video projector's"
    ours = f"{sizes} CIELAB^3; {inside}; blue L* {blue[1][0]:.0f} against {blue[0][0]:.0f}"
    return Result(ours, figures, relations, (f"{ITEM.name}.png",))


def primaries(model: PredictionModel) -> np.ndarray:
    """Lab of each channel or ink alone at full."""
    return XYZ_to_Lab((model.pattern.A + np.asarray(model.pattern.black)[:, None]).T, model.white_point)


def video_projector(model: PredictionModel) -> PredictionModel:
    """A projector on white paper: the columns of all clusters of the second surface together, one cluster."""
    assert model.white is not None
    K, N = len(model.clusters), len(model.channels)
    A = model.white.A.reshape(3, K, N).sum(axis=1)
    surface = SurfaceModel(A, model.white.black)
    return PredictionModel(model.channels, ("white",), surface, None, model.white_point, model.response)


def under_white_of(model: PredictionModel, other: PredictionModel) -> PredictionModel:
    """A one-surface model at the other's luminance, judged under the other's white."""
    full = model.pattern.A.sum(axis=1) + model.pattern.black
    scale = other.white_point[1] / full[1]
    surface = SurfaceModel(scale * model.pattern.A, scale * np.asarray(model.pattern.black))
    return replace(model, pattern=surface, white_point=other.white_point, correction=None)


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
