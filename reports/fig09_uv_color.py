"""Fig. 9: colour photographs from a gray ultraviolet projection on red, green and blue fluorescent inks."""

from __future__ import annotations

import sys

import numpy as np

from paxel_design.contact_sheet import Group, Tile
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.storage import load_model, read_image
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import Shown, shared, show, view_note, write_sheet

PHOTOGRAPHS = ("astronaut", "coffee", "chelsea")

ITEM = Item(
    "fig09_uv_color",
    "Fig. 9",
    "photographs in full colour from one UV channel, K = 3; greens and blues saturated, red weaker",
    ("uv-rgb",),
)


def make(run: Run) -> Result:
    """The gray projection images and what is seen of them."""
    installation = shared("uv-rgb", run.quick)
    names = PHOTOGRAPHS[:1] if run.quick else PHOTOGRAPHS
    shown = {name: show(installation, "monochrome", (name,), f"fig09-{name}") for name in names}
    write_sheet(
        run.folder / f"{ITEM.name}.jpg",
        [Group("Ultraviolet light on fluorescent inks", tuple(_row(one) for one in shown.values()))],
        "Colour from one channel",
        "after the paper's Fig. 9; gray: the projection image of one channel",
    )
    model = load_model(installation.folder("calibration") / "model.json")
    Lab = XYZ_to_Lab((model.pattern.A + model.pattern.black[:, None]).T, model.white_point)
    chroma = dict(zip(model.clusters, np.hypot(Lab[:, 1], Lab[:, 2]), strict=True))
    figures = {f"chroma of {name} alone": Figure(value, "CIELAB", "CIELAB") for name, value in chroma.items()}
    for name, one in shown.items():
        view = one.preview["on_pattern"]
        figures[f"{name}, dE00 mean"] = Figure(view["dE00_mean"], "dE00", "colour difference")
        figures[f"{name}, chroma seen"] = Figure(view["chroma_mean"], "CIELAB", "CIELAB")
    views = [one.preview["on_pattern"] for one in shown.values()]
    errors = [view["dE00_mean"] for view in views]
    relations = {
        "every projection image has one channel": all(_gray(one).ndim == 2 for one in shown.values()),
        "each photograph is seen within dE00 2 of its mapped picture, the error of the paper's model": max(errors) < 2,
        "the chroma that was wanted is seen, within a tenth": all(
            abs(view["chroma_mean"] / view["chroma_mean_mapped"] - 1) < 0.1 for view in views
        ),
    }
    words = ", ".join(f"{name} {value:.0f}" for name, value in chroma.items())
    ours = f"seen from 4 m within dE00 {min(errors):.2f} to {max(errors):.2f}; chroma of the inks: {words}"
    return Result(ours, figures, relations, (f"{ITEM.name}.jpg",))


def _gray(shown: Shown) -> np.ndarray:
    return read_image(shown.installation.folder("projection") / f"{shown.name}.png")


def _row(shown: Shown) -> tuple[Tile, ...]:
    gray = np.repeat(_gray(shown)[..., None], 3, axis=2)
    (source,) = shown.sources.values()
    return (
        Tile(read_image(source), f"source: {source.stem}"),
        Tile(gray, "the projection image"),
        Tile(gray, "its middle at 100 %", cropped=True),
        Tile(shown.picture("pattern"), "seen on the print", view_note(shown, "pattern"), emphasis=True),
    )


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
