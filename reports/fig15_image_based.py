"""Fig. 15: the same effects through the image-based model, A of every pixel from the camera, beside the spectral one.

Both installations have the same captures; only ``[model] kind`` differs.
"""

from __future__ import annotations

import sys
from pathlib import Path

from paxel_design.contact_sheet import Group
from paxel_runtime.installation import Installation
from paxel_runtime.stages import calibrate
from paxel_runtime.storage import read_json
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import Shown, finish, seen_row, shared, show_all, write_sheet

EFFECTS = {"hue-shift:90": ("coffee",), "dual-image": ("astronaut", "chelsea")}
SURFACES = ("pattern", "white")

ITEM = Item(
    "fig15_image_based",
    "Fig. 15",
    "colour-changing effects through the image-based model work too; more ghosting than with the spectral model",
    ("bw-checkerboard",),
)


def make(run: Run) -> Result:
    """Each effect through both models; the quick set leaves out the hue shift."""
    spectral = shared("bw-checkerboard", run.quick)
    models = {"image-based": image_based(spectral), "spectral": spectral}
    wanted = {f"fig15-{text.split(':')[0]}": (text, pictures) for text, pictures in EFFECTS.items()}
    if run.quick:
        del wanted["fig15-hue-shift"]
    shown = {name: list(show_all(one, wanted).values()) for name, one in models.items()}
    groups = [Group(f"{name} model", tuple(seen_row(one, one.name[6:]) for one in of)) for name, of in shown.items()]
    notes = "after the paper's Fig. 15; the eye adapted"
    write_sheet(run.folder / f"{ITEM.name}.jpg", groups, "Image-based and spectral", notes)
    figures: dict[str, Figure] = {}
    for name, installation in models.items():
        accuracy = read_json(installation.folder("calibration") / "accuracy.json")
        for surface in SURFACES:
            error = accuracy[surface]["dE00_mean"]
            figures[f"{name}, prediction, {surface}"] = Figure(error, "dE00", "colour difference")
            for one in shown[name]:
                view, words = one.preview[f"on_{surface}"], f"{name}, {one.name[6:]}, {surface}"
                figures[f"{words}, dE00 mean"] = Figure(view["dE00_mean"], "dE00", "colour difference")
                if view["ghosting_percent"] is not None:
                    figures[f"{words}, ghosting"] = Figure(view["ghosting_percent"], "%", "percent")
    error = {name: _mean(of) for name, of in shown.items()}
    relations = {
        "the spectral model is the more accurate one": error["spectral"] < error["image-based"],
        "the image-based effects are seen within dE00 3": error["image-based"] < 3,
    }
    ours = f"seen within dE00 {error['image-based']:.2f} (image-based) against {error['spectral']:.2f} (spectral)"
    return Result(ours, figures, relations, (f"{ITEM.name}.jpg",))


def image_based(spectral: Installation) -> Installation:
    """The installation beside it that has its print and captures, calibrated image-based."""
    place: Path = spectral.path.parent / f"{spectral.path.name}-image"
    model = spectral.settings.model.model_copy(update={"kind": "image"})
    settings = spectral.settings.model_copy(update={"model": model})
    if not (place / "paxel.toml").is_file():
        installation = Installation.create(place, settings)
        for stage in ("print", "captures"):
            (place / stage).symlink_to(spectral.folder(stage).resolve(), target_is_directory=True)
        calibrate(installation)
    return finish(Installation.open(place))


def _mean(shown: list[Shown]) -> float:
    errors = [one.preview[f"on_{surface}"]["dE00_mean"] for one in shown for surface in SURFACES]
    return sum(errors) / len(errors)


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
