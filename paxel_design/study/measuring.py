"""One case of a study, carried through the stages that the single commands call; and what is read off it.

Works in an installation of its own, on the virtual bench. Which cases there are, and what becomes of their figures, is
not known here.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from paxel_design.gamut import JointGamut, hue_change_area, hue_figures, lightness_area, lightness_figures
from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_design.stages.projection import make_previews, make_projection_stage
from paxel_design.study.sharing import take_over
from paxel_design.workers import Tell
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.errors import GamutError, PaxelError
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import DualImage
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.settings import Settings
from paxel_runtime.stages import calibrate, open_devices
from paxel_runtime.storage import load_model, read_json

__all__ = ["HUE_DEG", "measure_case"]

HUE_DEG = 180.0
"""Turn of hue that the hue area is asked for (Section VI-B)."""

_PHOTOGRAPHS = {"on_pattern": "astronaut.png", "on_white": "coffee.png"}
"""Inside scikit-image's wheel; their mapped L* correlate below 0.5, as a test of ghosting needs."""

_SHARES = {"captures": 0.05, "calibration": 0.65, "gamut": 0.80, "ghosting": 0.84}
"""Where a case stands when a stage begins."""


def measure_case(
    folder: Path, settings: Settings, tell: Tell, *, sibling: Path | None = None, ghosting: bool = True
) -> dict[str, Any]:
    """Calibrate one case as a whole and read its figures; goes on where an earlier run stopped.

    Parameters
    ----------
    folder : Path
        Of the case's installation; one with other settings is replaced.
    settings : Settings
    tell : callable
        Told what is done, and the share of the whole.
    sibling : Path, optional
        Installation of another case of the same print, whose structured light this one takes over.
    ghosting : bool
        Also show two photographs at once, and measure what is seen of each in the other.

    Returns
    -------
    dict
        ``measured_on``; ``lightness`` and ``hue`` as in ``gamut/`` (None where the surfaces have no grays in common, or
        there is one surface); ``dual_image``, volumes of the product pair (None where there is none); ``prediction`` as
        in ``accuracy.json``; ``ghosting_percent`` on each surface, or None; ``shared_pictures``; ``seconds``.
    """
    began = time.perf_counter()
    installation = _open_or_new(folder, settings)
    shared = 0
    if sibling is not None and (sibling / "paxel.toml").is_file():
        shared = take_over(installation, Installation.open(sibling))
    _make_stages(installation, tell)
    model = load_model(installation.folder("calibration") / "model.json")
    tell("gamut", _SHARES["gamut"])
    figures = _gamut_figures(installation, model)
    ghosts = None
    if ghosting and figures["dual_image"] is not None:
        tell("two photographs at once", _SHARES["ghosting"])
        ghosts = _ghosting(installation)
    accuracy = read_json(installation.folder("calibration") / "accuracy.json")
    return {
        "measured_on": accuracy["measured_on"],
        **figures,
        "prediction": {key: accuracy[key] for key in ("n", "model", *model.surfaces, "linear")},
        "ghosting_percent": ghosts,
        "shared_pictures": shared,
        "seconds": round(time.perf_counter() - began, 1),
    }


def _open_or_new(folder: Path, settings: Settings) -> Installation:
    if (folder / "paxel.toml").is_file():
        try:
            installation = Installation.open(folder)
        except PaxelError:  # left by another version
            installation = None
        if installation is not None and installation.settings == settings:
            return installation
    shutil.rmtree(folder, ignore_errors=True)
    return Installation.create(folder, settings)


def _make_stages(installation: Installation, tell: Tell) -> None:
    """Print, captures and calibration, as far as they are not there."""

    def telling(message: str, done: int, total: int) -> None:
        first, last = _SHARES["captures"], _SHARES["calibration"]
        tell(f"capture, {message}", first + (last - first) * done / max(total, 1))

    runs: dict[str, Callable[[], object]] = {
        "print": lambda: make_print(installation),
        "captures": lambda: capture(installation, open_devices(installation, kind="virtual"), telling),
        "calibration": lambda: calibrate(
            installation, lambda message: tell(f"calibrate, {message}", _SHARES["calibration"])
        ),
    }
    for stage, run in runs.items():
        if next(s.state for s in installation.status() if s.stage.name == stage) != "done":
            tell(stage, _SHARES.get(stage, 0.0))
            run()


def _gamut_figures(installation: Installation, model: PredictionModel) -> dict[str, Any]:
    """What the model can show on two surfaces; None for what it cannot."""
    figures: dict[str, Any] = {"lightness": None, "hue": None, "dual_image": None}
    if model.white is None:
        return figures
    joint = JointGamut(model)
    try:
        figures["lightness"] = lightness_figures(lightness_area(joint))
        figures["hue"] = hue_figures(hue_change_area(joint, HUE_DEG))
        records = make_gamut(installation, DualImage(), "pattern")
    except GamutError:  # no grays in common, or no two sets of colours: a finding, not a fault
        return figures
    volumes = {record["shown_on"]: record["volume"] for record in records.values()}
    return figures | {"dual_image": {f"volume_{surface}": volumes[surface] for surface in ("pattern", "white")}}


def _ghosting(installation: Installation) -> dict[str, float | None]:
    """Share of the other photograph that is left in the view of each surface, under static mapping."""
    effect = DualImage()
    with _photographs() as pictures:
        make_projection_stage(installation, effect, pictures, name=effect.key, shown_on="pattern", mapping="static")
        records, _ = make_previews(installation, [effect.key])
    seen = records[f"{effect.key}.json"]
    return {surface: seen[f"on_{surface}"]["ghosting_percent"] for surface in ("pattern", "white")}


@contextmanager
def _photographs() -> Iterator[dict[str, Path]]:
    data = files("skimage") / "data"
    with as_file(data / _PHOTOGRAPHS["on_pattern"]) as on_pattern, as_file(data / _PHOTOGRAPHS["on_white"]) as on_white:
        yield {"on_pattern": on_pattern, "on_white": on_white}
