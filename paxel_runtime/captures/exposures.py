"""The plan of a calibration: which frame is shown on which surface, and what looks at it.

Pure data and pure functions: a plan is a list of `Exposure`, a frame is made from an exposure whenever it is needed.
Nothing here drives a device or reads a file. The surfaces are ``"pattern"``; ``"white"``, the second surface, which may
be a gray sheet; and then ``"paper"``, the white paper that all colours are relative to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.structured_light import Method, plan_frames

__all__ = [
    "DRIFT_INTERVAL",
    "EXTRA_COUNT",
    "GRID_STEPS",
    "MASKS",
    "RAMP_STEPS",
    "RANDOM_COUNT",
    "Exposure",
    "Surface",
    "cluster_counts",
    "exposure_from_dict",
    "exposure_name",
    "exposure_to_dict",
    "frame_codes",
    "guide_channel",
    "mask_pixels",
    "plan_geometry",
    "plan_readings",
    "white_reading",
]

RAMP_STEPS = 33
"""Steps of a response ramp, 0 and full included (design: section 7)."""

RANDOM_COUNT = 100
"""Random projections that test the prediction (paper: Table I)."""

EXTRA_COUNT = 60
"""Random projections that a measured correction is fitted to, apart from those that test it (design: section 7)."""

GRID_STEPS = 5
"""Levels of each input of the test grid that takes the place of random projections for up to 3 inputs (Table II)."""

DRIFT_INTERVAL = 50
"""Readings from one repetition of full white to the next."""

MASKS = ("checker", "columns", "rows", "window")
"""Frames of two values by place; see `mask_pixels`."""

Surface = Literal["pattern", "white", "paper"]

_GRID_INPUTS = 3


@dataclass(frozen=True)
class Exposure:
    """One frame shown on one surface and looked at once.

    Attributes
    ----------
    name : str
        Unique in the plan; the file of a picture is ``<name>.tif``.
    surface : "pattern" | "white" | "paper"
    device : "camera" | "meter"
    light : str
        Name of a structured-light frame shown in `channel`, or empty.
    P : tuple of K tuples of N floats
        Device values 0..1 of each cluster (one row: the whole frame); empty for structured light.
    clusters : int
        K of the sorting whose clusters `P` lights; 0 for the whole frame.
    channel : str
        The only channel that is lit, so that the camera saves one plane; empty for a picture of three planes.
    mask : str
        One of `MASKS`: the first row of `P` lights its pixels, the second the others; or empty.
    position : int
        Where the meter looks: 0 = the centre, others as in `meter_positions`.
    """

    name: str
    surface: Surface
    device: Literal["camera", "meter"]
    light: str = ""
    P: tuple[tuple[float, ...], ...] = ()
    clusters: int = 0
    channel: str = ""
    mask: str = ""
    position: int = 0


def guide_channel(channels: tuple[str, ...]) -> str:
    """The channel whose structured light is decoded in full; the others follow it (the middle one: green of RGB)."""
    return channels[len(channels) // 2]


def cluster_counts(count: int, colorants: int) -> tuple[int, int]:
    """The installation's K, and the other K that is measured beside it for comparison."""
    return count, (colorants if count > colorants else count + 1)


def plan_geometry(
    channels: tuple[str, ...],
    resolution: tuple[int, int],
    surfaces: tuple[Surface, ...] = ("pattern", "white"),
    method: Method = "lines",
) -> list[Exposure]:
    """Pictures that find where each projector pixel lands and which colorant it lights.

    Structured light on the print (the guide channel in full, the others with shifted frames only), full white and
    black on it; then the same white and black, and each channel alone, on every other surface.
    """
    guide = guide_channel(channels)
    plan = [
        Exposure(f"light-{channel}-{frame.name}", "pattern", "camera", light=frame.name, channel=channel)
        for channel in sorted(channels, key=lambda name: name != guide)
        for frame in plan_frames(*resolution, coarse=channel == guide, method=method)
    ]
    full, dark = (1.0,) * len(channels), (0.0,) * len(channels)
    levels: tuple[Literal["full", "dark"], ...] = ("full", "dark")
    for surface in surfaces:
        plan += [
            Exposure(f"{surface}-white", surface, "camera", P=(full,)),
            Exposure(f"{surface}-black", surface, "camera", P=(dark,)),
        ]
        plan += [
            Exposure(exposure_name(surface, level, name, channels), surface, "camera", P=(P,), channel=name)
            for j, name in enumerate(channels)
            for level, P in zip(levels, (_one_hot(j, len(channels)), dark), strict=True)
            if (surface, name) != ("pattern", guide)  # these two are frames of its structured light
        ]
    return plan


def exposure_name(surface: str, level: Literal["full", "dark"], channel: str, channels: tuple[str, ...]) -> str:
    """Name of the picture of one channel at full, or of all dark with this channel's exposure time."""
    if surface == "pattern" and channel == guide_channel(channels):
        return f"light-{channel}-{'white' if level == 'full' else 'black'}"
    return f"{surface}-{level}-{channel}"


def plan_readings(
    channels: tuple[str, ...],
    counts: Iterable[int],
    *,
    bits: int,
    seed: int,
    surfaces: tuple[Surface, ...],
    extra: int = 0,
    ramps: Literal["meter", "camera"] = "meter",
) -> list[Exposure]:
    """Readings that make the prediction model and test it, the last surface first (it lies there already).

    On the pattern and the second surface: full white, black, each channel on each cluster alone, and the test
    projections: `RANDOM_COUNT` random ones, or the grid of `GRID_STEPS` levels where a K has at most 3 inputs; on the
    second surface (or the only one) also the response ramps. Full white again after every `DRIFT_INTERVAL` readings
    and at the end. On the white paper, where that is neither: full white alone. The camera looks at the single clusters
    of the first K too.

    Parameters
    ----------
    counts : iterable of int
        Every K to measure; the first is the installation's own.
    bits : int
        Random projections are made of whole device codes.
    seed : int
        Seed of the random projections.
    surfaces : tuple of str
        ``("pattern",)``, ``("pattern", "white")`` or ``("pattern", "white", "paper")``.
    extra : int
        Random projections ``extra-<surface>-K<k>-<i>`` of the first K, for a measured correction.
    ramps : "meter" | "camera"
        What looks at the response ramps.
    """
    N, top = len(channels), 2**bits - 1
    full, dark = (1.0,) * N, (0.0,) * N
    plan: list[Exposure] = []
    if "paper" in surfaces:
        plan.append(Exposure("read-paper-white", "paper", "meter", P=(full,)))
    measured = [surface for surface in reversed(surfaces) if surface != "paper"]
    for surface in measured:
        here = [
            Exposure(f"read-{surface}-white", surface, "meter", P=(full,)),
            Exposure(f"read-{surface}-black", surface, "meter", P=(dark,)),
        ]
        if surface == measured[0]:
            here += [
                Exposure(
                    f"ramp-{surface}-{channel}-{k:02d}", surface, ramps, P=(_one_hot(j, N, level),), channel=channel
                )
                for j, channel in enumerate(channels)
                for k, level in enumerate(np.rint(np.linspace(0, top, RAMP_STEPS)) / top)
            ]
        for place, K in enumerate(counts):
            for i in range(K):
                for j, channel in enumerate(channels):
                    P = tuple(_one_hot(j, N) if m == i else dark for m in range(K))
                    one = f"{surface}-K{K}-{i}-{channel}"
                    here.append(Exposure(f"read-{one}", surface, "meter", P=P, clusters=K, channel=channel))
                    if place == 0:
                        here.append(Exposure(f"cluster-{one}", surface, "camera", P=P, clusters=K, channel=channel))
            if K * N <= _GRID_INPUTS:
                here += _cluster_readings("grid", surface, _grid_codes(K, N, top) / top)
            else:
                codes = np.random.default_rng((seed, K)).integers(0, top + 1, (RANDOM_COUNT, K, N))
                here += _cluster_readings("random", surface, codes / top)
            if place == 0:
                codes = np.random.default_rng((seed, K, 1)).integers(0, top + 1, (extra, K, N))
                here += _cluster_readings("extra", surface, codes / top)
        plan += _with_drift_checks(here, surface, full)
    return plan


def white_reading(names: Iterable[str]) -> str:
    """Name of the reading that is the white point: full white on white paper, or else on the only surface.

    Parameters
    ----------
    names : iterable of str
        Of all readings there are.
    """
    known = set(names)
    return next((f"read-{s}-white" for s in ("paper", "white") if f"read-{s}-white" in known), "read-pattern-white")


def _with_drift_checks(exposures: list[Exposure], surface: Surface, full: tuple[float, ...]) -> list[Exposure]:
    """The exposures of one surface, with full white again after every `DRIFT_INTERVAL` readings and at the end."""
    plan: list[Exposure] = []
    readings, checks = 0, 0
    for exposure in exposures:
        plan.append(exposure)
        readings += exposure.device == "meter"
        if readings == DRIFT_INTERVAL or exposure is exposures[-1]:
            plan.append(Exposure(f"drift-{surface}-{checks:02d}", surface, "meter", P=(full,)))
            readings, checks = 0, checks + 1
    return plan


def _grid_codes(K: int, N: int, top: int) -> NDArray[np.float64]:
    """Device codes (5^n, K, N) of every combination of `GRID_STEPS` levels."""
    levels = np.rint(np.linspace(0, top, GRID_STEPS))
    return np.stack(np.meshgrid(*[levels] * (K * N), indexing="ij"), axis=-1).reshape(-1, K, N)


def _cluster_readings(purpose: str, surface: Surface, P: NDArray[np.floating]) -> list[Exposure]:
    """Readings of projections P (count, K, N)."""
    K = P.shape[1]
    return [
        Exposure(f"{purpose}-{surface}-K{K}-{r:03d}", surface, "meter", clusters=K, P=tuple(map(tuple, one)))
        for r, one in enumerate(P.tolist())
    ]


def frame_codes(
    exposure: Exposure,
    channels: tuple[str, ...],
    resolution: tuple[int, int],
    bits: int,
    labels: Mapping[int, NDArray[np.uint8]],
) -> NDArray[np.uint16]:
    """Device codes of an exposure's frame, (H, W, N).

    Parameters
    ----------
    labels : dict of K -> (H, W) uint8
        Cluster labels of each sorting; 255 (outside the pattern) stays dark.
    """
    width, height = resolution
    top = 2**bits - 1
    codes = np.zeros((height, width, len(channels)), np.uint16)
    if exposure.light:
        method: Method = "phase" if exposure.light.startswith("phase") else "lines"
        frames = {frame.name: frame for frame in plan_frames(width, height, method=method)}
        lit = frames[exposure.light].pixels(width, height)
        codes[..., channels.index(exposure.channel)] = np.rint(lit.astype(np.float32) * top)
    elif exposure.mask:
        values = np.rint(np.array(exposure.P) * top).astype(np.uint16)
        codes[:] = np.where(mask_pixels(exposure.mask, width, height)[..., None], values[0], values[1])
    elif exposure.clusters:
        table = np.zeros((256, len(channels)), np.uint16)
        table[: exposure.clusters] = np.rint(np.array(exposure.P) * top)
        codes = np.take(table, labels[exposure.clusters], axis=0)
    else:
        codes[:] = np.rint(np.array(exposure.P[0]) * top).astype(np.uint16)
    return codes


def mask_pixels(mask: str, width: int, height: int) -> NDArray[np.bool_]:
    """Pixels of a mask, (H, W) bool: every other pixel, column or row from the first on, or the middle of the frame.

    Parameters
    ----------
    mask : str
        One of `MASKS`; a window with its share of width and height, as ``"window 0.4"``.
    """
    kind, _, share = mask.partition(" ")
    row, column = np.mgrid[:height, :width]
    if kind == "window":
        rows = abs(row - (height - 1) / 2) < 0.5 * float(share) * height
        return np.asarray(rows & (abs(column - (width - 1) / 2) < 0.5 * float(share) * width))
    return np.asarray({"checker": row + column, "columns": column, "rows": row}[kind] % 2 == 0)


def exposure_to_dict(exposure: Exposure) -> dict[str, Any]:
    """An exposure as it stands in ``exposures.json``: only what differs from the default."""
    return {key: value for key, value in asdict(exposure).items() if value or key in ("name", "surface", "device")}


def exposure_from_dict(data: Mapping[str, Any]) -> Exposure:
    """Inverse of `exposure_to_dict`."""
    return Exposure(**{**data, "P": tuple(tuple(float(v) for v in row) for row in data.get("P", ()))})


def _one_hot(j: int, N: int, level: float = 1.0) -> tuple[float, ...]:
    return tuple(float(level) if m == j else 0.0 for m in range(N))
