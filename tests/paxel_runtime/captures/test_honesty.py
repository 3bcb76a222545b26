"""An honest projector is called honest; every trick of a dishonest one is found and named with its switch."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, zoom

from paxel_runtime.captures.exposures import Exposure, frame_codes, plan_geometry, plan_readings
from paxel_runtime.captures.honesty import Finding, honesty_figures, judge, plan_honesty
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM

RGB = ("red", "green", "blue")
W, H = 192, 108
LIGHT = np.exp(-(((WAVELENGTHS_NM - np.array([[620.0], [540.0], [460.0]])) / 25) ** 2))
XY = np.stack(np.meshgrid(np.arange(W), np.arange(H)), axis=-1).astype(np.float32) * 2 + 0.5
PLAN = [
    *(e for e in plan_geometry(RGB, (W, H)) if e.name in ("white-full-green", "white-dark-green")),
    *(e for e in plan_readings(RGB, (2,), bits=8, seed=0, surfaces=("pattern", "white")) if e.surface == "white"),
    *plan_honesty(RGB, "white", bits=8, spot_share=0.25),
]

Trick = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def _judge(codes_trick: Trick = lambda P: P, light_trick: Trick = lambda x: x) -> dict[str, Finding]:
    """Findings on a projector that plays a trick on device values (H, W, 3) or on light."""
    readings, pictures = {}, {}
    for e in PLAN:
        if e.clusters:
            continue
        P = frame_codes(e, RGB, (W, H), 8, {}) / 255
        x = light_trick(np.clip(codes_trick(P), 0, 1) ** 2.2) + 0.001
        if e.device == "meter":
            spot = x[H // 2 - 12 : H // 2 + 12, W // 2 - 12 : W // 2 + 12].mean(axis=(0, 1))
            readings[e.name] = spot @ LIGHT
        else:
            pictures[e.name] = _photograph(e, x)
    findings = judge(readings, RGB, "white", pictures.__getitem__, XY)
    return {f.question: f for f in findings}


def _photograph(e: Exposure, x: NDArray[np.float64]) -> NDArray[np.uint16]:
    """A camera with two pixels a projector pixel, a little blurred."""
    plane = np.repeat(np.repeat(x[..., RGB.index(e.channel)], 2, axis=0), 2, axis=1)
    for axis in (0, 1):
        plane = gaussian_filter1d(plane, 0.7, axis=axis)
    return np.rint(40000 * plane).astype(np.uint16)


def test_an_honest_projector_is_honest() -> None:
    findings = _judge()
    assert set(findings) == {"white", "grays", "near black", "surround", "neighbours", "single pixels"}
    assert {f.word for f in findings.values()} == {"honest"}
    assert honesty_figures(list(findings.values()))["word"] == "honest"


def _white_boost(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return x + 0.4 * x.min(axis=-1, keepdims=True)


def _dynamic_contrast(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return x * (0.6 + 0.4 * x.mean())


def _sharpening(P: NDArray[np.float64]) -> NDArray[np.float64]:
    around = (np.roll(P, 1, 0) + np.roll(P, -1, 0) + np.roll(P, 1, 1) + np.roll(P, -1, 1)) / 4
    return P + 0.3 * (P - around)


def _scaling(P: NDArray[np.float64]) -> NDArray[np.float64]:
    small = zoom(P, (0.9, 0.9, 1), order=1)
    return np.clip(zoom(small, (H / small.shape[0], W / small.shape[1], 1), order=1), 0, 1)[:H, :W]


def _black_crush(P: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.clip((P - 20 / 255) / (1 - 20 / 255), 0, 1)


def _color_management(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return x * (1 - 0.08 * (x.sum(axis=-1, keepdims=True) - x))


@pytest.mark.parametrize(
    ("trick", "question", "cure"),
    [
        ({"light_trick": _white_boost}, "white", "white boost"),
        ({"light_trick": _color_management}, "white", "colour management"),
        ({"light_trick": _dynamic_contrast}, "surround", "dynamic contrast"),
        ({"codes_trick": _sharpening}, "neighbours", "sharpening"),
        ({"codes_trick": _scaling}, "single pixels", "scaling"),
        ({"codes_trick": _black_crush}, "near black", "brightness"),
    ],
)
def test_every_trick_is_found(trick: dict[str, Trick], question: str, cure: str) -> None:
    findings = _judge(**trick)
    assert findings[question].word == "dishonest", findings[question]
    assert cure in findings[question].verdict
    assert honesty_figures(list(findings.values()))["word"] == "dishonest"


def test_a_small_deviation_is_noticeable_and_no_more() -> None:
    finding = _judge(light_trick=lambda x: x * (1 - 0.01 * (x.sum(axis=-1, keepdims=True) - x)))["white"]
    assert finding.word == "noticeable"
    assert finding.figure == pytest.approx(-0.02, abs=1e-3)  # every channel loses 1 % to each of the two others


def test_questions_without_readings_are_not_asked() -> None:
    assert judge({}, RGB, "white") == []
    full, dark = np.ones(3) @ LIGHT, np.zeros(81)
    readings = {"read-white-white": full, "read-white-black": dark} | {
        f"ramp-white-{name}-32": light for name, light in zip(RGB, LIGHT, strict=True)
    }
    assert [f.question for f in judge(readings, RGB, "white")] == ["white"]


def test_a_spot_as_large_as_the_frame_is_not_asked_about_its_surround() -> None:
    names = [e.name for e in plan_honesty(RGB, "white", bits=8, spot_share=0.7)]
    assert not any("window" in name for name in names)
    windows = [e.mask for e in plan_honesty(RGB, "white", bits=8, spot_share=0.4) if "window" in e.name]
    assert windows == ["window 0.6"] * 2


def test_one_channel_is_not_asked_whether_channels_add_up() -> None:
    plan = plan_honesty(("uv",), "pattern", bits=10, spot_share=0.2)
    assert all(len(row) == 1 for e in plan for row in e.P)
    readings = {"read-pattern-white": np.ones(81), "read-pattern-black": np.zeros(81)}
    assert "white" not in [f.question for f in judge(readings, ("uv",), "pattern")]
