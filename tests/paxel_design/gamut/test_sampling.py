"""The paper's sampling: the kernel against plain numpy, and its cells against the exact sets."""

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

from paxel_design.gamut import JointGamut, sampled_figures, sampled_gamut, sub_gamut
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping import luminance_relation
from paxel_runtime.model.colorimetry import Lab_to_LCh, Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.effects import CHROMA_FLOOR, Chroma, Decolorize, Effect, Full, HueShift, Neutralize
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]


@pytest.mark.parametrize(
    "effect",
    [
        Full(),
        HueShift(60, 20),
        HueShift(120),
        Neutralize((50, 3, 0), 9.0),
        Decolorize("free", 4.0),
        Decolorize("relative"),
    ],
    ids=str,
)
@pytest.mark.parametrize("shown_on", ["pattern", "white"])
def test_the_kernel_marks_what_plain_arrays_mark(measured_model: Models, effect: Effect, shown_on: str) -> None:
    model = measured_model(1, 2)
    joint, steps = JointGamut(model), 5
    cells = sampled_gamut(joint, effect, shown_on, steps=steps)
    x = np.array(list(product(np.linspace(0, 1, steps), repeat=model.n)))
    own, partner = model.predict(x) if shown_on == "pattern" else reversed(model.predict(x))
    if isinstance(effect, HueShift):
        p, q = Lab_to_LCh(own), Lab_to_LCh(partner)
        turn = np.abs((q[:, 2] - p[:, 2] + 180) % 360 - 180)
        band = np.inf if effect.lightness_band is None else effect.lightness_band
        keep = (turn >= effect.angle_deg) & (q[:, 1] >= CHROMA_FLOOR) & (np.abs(q[:, 0] - p[:, 0]) <= band)
    elif isinstance(effect, Neutralize):
        keep = dE00(partner, effect.Lab) <= effect.tolerance
    elif isinstance(effect, Decolorize):
        gray = partner * [1.0, 0, 0]
        if effect.lightness == "relative":
            surfaces = model.surfaces
            other = surfaces["white" if shown_on == "pattern" else "pattern"]
            slope, base = luminance_relation(surfaces[shown_on], other)
            Y = slope * Lab_to_XYZ(own, np.ones(3))[:, 1] + base
            gray[:, 0] = XYZ_to_Lab(np.repeat(Y[:, None], 3, axis=1), np.ones(3))[:, 0]
        keep = dE00(partner, gray) <= (effect.tolerance or 2.0)
    else:
        keep = np.ones(len(x), bool)
    assert cells.field is not None
    expected = np.zeros(cells.field.values.shape, bool)
    expected[tuple(np.rint(own[keep] - cells.field.origin).astype(int).T)] = True
    found = cells.field.values > 0
    assert np.count_nonzero(expected) > 5
    # At most a sample on the very border of a cell or of the condition may round the other way.
    assert np.count_nonzero(expected != found) <= 1 + 1e-3 * np.count_nonzero(expected)
    assert sampled_figures(cells)["volume"] == np.count_nonzero(found)


@pytest.mark.parametrize("effect", [Full(), HueShift(45), Neutralize((50, 0, 0), 2.0)])
def test_samples_lie_in_the_exact_sets(measured_model: Models, effect: Full | HueShift | Neutralize) -> None:
    joint = JointGamut(measured_model(1, 2))
    sampled = sampled_gamut(joint, effect, steps=6)
    assert sampled.field is not None
    marked = sampled.field.origin + np.argwhere(sampled.field.values > 0)
    XYZ = Lab_to_XYZ(marked, sampled.white_point)
    exact = sub_gamut(joint, effect, step=6.0)
    # A cell is marked for a sample up to 0.87 away from its middle: dark ones lie that far outside.
    inside = exact.slack(XYZ) > -0.03
    assert len(marked) > 2, "few: at 7 steps sampling misses nearly all of the neutralisation set"
    assert inside.mean() > 0.97


def test_sampling_refuses_what_it_cannot_do(measured_model: Models) -> None:
    with pytest.raises(InputError, match="1e10"):
        sampled_gamut(JointGamut(measured_model(1, 3)), Full())
    with pytest.raises(InputError, match="no condition on single pairs"):
        sampled_gamut(JointGamut(measured_model(1, 2)), Chroma())
