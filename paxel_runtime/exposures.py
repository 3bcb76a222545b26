"""The plan of a calibration: which frame is shown on which surface, and what looks at it.

Pure data and pure functions: a plan is a list of `Exposure`, a frame is made from an exposure whenever it is needed.
Nothing here drives a device or reads a file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.structured_light import plan_frames

__all__ = [
    "RAMP_STEPS",
    "RANDOM_COUNT",
    "Exposure",
    "cluster_counts",
    "exposure_from_dict",
    "exposure_name",
    "exposure_to_dict",
    "frame_codes",
    "guide_channel",
    "plan_geometry",
    "plan_readings",
]

RAMP_STEPS = 33
"""Steps of a response ramp, 0 and full included (design: section 7)."""

RANDOM_COUNT = 100
"""Random projections that test the prediction (paper: Table I)."""

Surface = Literal["pattern", "white"]


@dataclass(frozen=True)
class Exposure:
    """One frame shown on one surface and looked at once.

    Attributes
    ----------
    name : str
        Unique in the plan; the file of a picture is ``<name>.tif``.
    surface : "pattern" | "white"
    device : "camera" | "meter"
    light : str
        Name of a structured-light frame shown in `channel`, or empty.
    P : tuple of K tuples of N floats
        Device values 0..1 of each cluster (one row: the whole frame); empty for structured light.
    clusters : int
        K of the sorting whose clusters `P` lights; 0 for the whole frame.
    channel : str
        The only channel that is lit, so that the camera saves one plane; empty for a picture of three planes.
    """

    name: str
    surface: Surface
    device: Literal["camera", "meter"]
    light: str = ""
    P: tuple[tuple[float, ...], ...] = ()
    clusters: int = 0
    channel: str = ""


def guide_channel(channels: tuple[str, ...]) -> str:
    """The channel whose structured light is decoded in full; the others follow it (the middle one: green of RGB)."""
    return channels[len(channels) // 2]


def cluster_counts(count: int, colorants: int) -> tuple[int, int]:
    """The installation's K, and the other K that is measured beside it for comparison."""
    return count, (colorants if count > colorants else count + 1)


def plan_geometry(channels: tuple[str, ...], resolution: tuple[int, int]) -> list[Exposure]:
    """Pictures that find where each projector pixel lands and which colorant it lights.

    Structured light on the print (the guide channel in full, the others with shifted lines only), full white and
    black on it; then the same white and black, and each channel alone, on the white surface.
    """
    guide = guide_channel(channels)
    plan = [
        Exposure(f"light-{channel}-{frame.name}", "pattern", "camera", light=frame.name, channel=channel)
        for channel in sorted(channels, key=lambda name: name != guide)
        for frame in plan_frames(*resolution, coarse=channel == guide)
    ]
    full, dark = (1.0,) * len(channels), (0.0,) * len(channels)
    surfaces: tuple[Surface, ...] = ("pattern", "white")
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
    channels: tuple[str, ...], counts: Iterable[int], *, bits: int, seed: int, surfaces: tuple[Surface, ...]
) -> list[Exposure]:
    """Readings that make the prediction model and test it, the white surface first (it lies there already).

    On each surface: full white, black, each channel on each cluster alone, and `RANDOM_COUNT` random projections; on
    the last surface of `surfaces` also the response ramps. The camera looks at the single clusters of the first K too.

    Parameters
    ----------
    counts : iterable of int
        Every K to measure; the first is the installation's own.
    bits : int
        Random projections are made of whole device codes.
    seed : int
        Seed of the random projections.
    """
    N = len(channels)
    top = 2**bits - 1
    counts = tuple(counts)
    plan: list[Exposure] = []
    for surface in reversed(surfaces):
        for name, level in (("white", 1.0), ("black", 0.0)):
            plan.append(Exposure(f"read-{surface}-{name}", surface, "meter", P=((level,) * N,)))
        if surface == surfaces[-1]:
            plan += [
                Exposure(
                    f"ramp-{surface}-{channel}-{k:02d}", surface, "meter", P=(_one_hot(j, N, level),), channel=channel
                )
                for j, channel in enumerate(channels)
                for k, level in enumerate(np.rint(np.linspace(0, top, RAMP_STEPS)) / top)
            ]
        for K in counts:
            rng = np.random.default_rng((seed, K))
            for i in range(K):
                for j, channel in enumerate(channels):
                    P = tuple(_one_hot(j, N) if m == i else (0.0,) * N for m in range(K))
                    one = f"{surface}-K{K}-{i}-{channel}"
                    plan.append(Exposure(f"read-{one}", surface, "meter", P=P, clusters=K, channel=channel))
                    if counts[0] == K:
                        plan.append(Exposure(f"cluster-{one}", surface, "camera", P=P, clusters=K, channel=channel))
            codes = rng.integers(0, top + 1, (RANDOM_COUNT, K, N)) / top
            plan += [
                Exposure(
                    f"random-{surface}-K{K}-{r:03d}", surface, "meter", clusters=K, P=tuple(map(tuple, P.tolist()))
                )
                for r, P in enumerate(codes)
            ]
    return plan


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
        frames = {frame.name: frame for frame in plan_frames(width, height)}
        codes[..., channels.index(exposure.channel)] = frames[exposure.light].pixels(width, height) * np.uint16(top)
    elif exposure.clusters:
        table = np.zeros((256, len(channels)), np.uint16)
        table[: exposure.clusters] = np.rint(np.array(exposure.P) * top)
        codes = np.take(table, labels[exposure.clusters], axis=0)
    else:
        codes[:] = np.rint(np.array(exposure.P[0]) * top).astype(np.uint16)
    return codes


def exposure_to_dict(exposure: Exposure) -> dict[str, Any]:
    """An exposure as it stands in ``exposures.json``: only what differs from the default."""
    return {key: value for key, value in asdict(exposure).items() if value or key in ("name", "surface", "device")}


def exposure_from_dict(data: Mapping[str, Any]) -> Exposure:
    """Inverse of `exposure_to_dict`."""
    return Exposure(**{**data, "P": tuple(tuple(float(v) for v in row) for row in data.get("P", ()))})


def _one_hot(j: int, N: int, level: float = 1.0) -> tuple[float, ...]:
    return tuple(float(level) if m == j else 0.0 for m in range(N))
