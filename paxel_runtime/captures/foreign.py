"""Structured light that other tools captured: a folder of pictures -> projector coordinates of every camera pixel.

Every file is looked at before anything is computed, and what is wrong is told by file name. The pictures are read one
at a time, twice, and never changed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.devices.photographs import PHOTOGRAPH_ENDINGS, list_photographs, read_photograph, to_one_plane
from paxel_runtime.errors import CalibrationError, DeviceError, InputError
from paxel_runtime.structured_light import Decoded, decode_gray_sequence, plan_gray_sequence
from paxel_runtime.structured_light.inspection import sequence_problem, sequence_problems
from paxel_runtime.structured_light.samples import Sample, take_sample

__all__ = ["SCHEMES", "DecodedFolder", "decode_folder", "plane_figures"]

SCHEMES = ("opencv-gray",)
"""Sequences that can be read: Gray code and its inverse, columns then rows, coarse first, then white and black."""

Progress = Callable[[str, int, int], None]


class DecodedFolder(NamedTuple):
    """Result of `decode_folder`."""

    decoded: Decoded
    figures: dict[str, Any]


def decode_folder(
    folder: Path,
    width: int,
    height: int,
    scheme: str = "opencv-gray",
    progress: Progress = lambda message, done, total: None,
) -> DecodedFolder:
    """Decode a folder of structured-light pictures, in the order of their names.

    Parameters
    ----------
    folder : Path
        Holds one picture a frame and no others: TIFF, PNG, JPEG, ...
    width, height : int
        Resolution of the projector.
    scheme : str
        One of `SCHEMES`.

    Raises
    ------
    InputError
        If the folder or the scheme does not exist.
    CalibrationError
        If a picture is missing, extra, swapped, repeated, cut short, of another size, saturated, black or moved: which
        file, what is wrong with it, what to do. Also if the projector cannot be seen at all.
    """
    if scheme not in SCHEMES:
        raise InputError(f"--scheme must be one of {', '.join(SCHEMES)}, got {scheme!r}")
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; name the folder of the captured pictures")
    names = [frame.name for frame in plan_gray_sequence(width, height)]
    files = list_photographs(folder)
    if not files:
        raise InputError(f"{folder} holds no pictures ({', '.join(PHOTOGRAPH_ENDINGS)})")
    _refuse_bad_captures(folder, files, names, f"{width} x {height}", progress)
    paths = dict(zip(names, files, strict=True))
    reads = 0

    def read(name: str) -> NDArray[np.uint16]:
        nonlocal reads
        reads += 1
        progress(f"decode {paths[name].name}", min(len(names) + reads, 2 * len(names)), 2 * len(names))
        return to_one_plane(read_photograph(paths[name]))

    decoded = decode_gray_sequence(read, width, height)
    return DecodedFolder(decoded, _figures(decoded, len(files), (width, height)))


def _refuse_bad_captures(
    folder: Path, files: Sequence[Path], names: Sequence[str], projector: str, progress: Progress
) -> None:
    """Look at a sample of every picture and refuse the folder with a line for each that is not what it should be."""
    samples: list[Sample] = []
    problems: list[str] = []
    for done, file in enumerate(files):
        progress(f"check {file.name}", done, 2 * len(files))
        try:
            samples.append(take_sample(to_one_plane(read_photograph(file))))
        except DeviceError as error:
            problems.append(str(error))
    sizes = Counter(sample.size for sample in samples)
    if not problems and len(sizes) > 1:
        usual = sizes.most_common(1)[0][0]
        problems = [
            f"{file.name} has {s.size[0]} x {s.size[1]} pixels, the others {usual[0]} x {usual[1]}: take all with the "
            "same camera, picture size and orientation"
            for file, s in zip(files, samples, strict=True)
            if s.size != usual
        ]
    if not problems and len(files) != len(names):
        found = sequence_problem([file.name for file in files], samples, names)
        problems = [f"a projector of {projector} pixels needs {len(names)} captures, got {len(files)}: {found}"]
    if not problems:
        by_frame = {name: file.name for name, file in zip(names, files, strict=True)}
        found_in = sequence_problems(dict(zip(names, samples, strict=True)), lambda name: by_frame[name])
        problems = _merged([(by_frame[problem.name], problem.text) for problem in found_in])
    if problems:
        more = [f"and {len(problems) - 8} more"] if len(problems) > 8 else []
        raise CalibrationError("\n".join([f"the captures in {folder} cannot be decoded:", *problems[:8], *more]))


def _merged(problems: Sequence[tuple[str, str]]) -> list[str]:
    """A line a problem; captures with the same one share it."""
    captures: dict[str, list[str]] = {}
    for file, text in problems:
        captures.setdefault(text, []).append(file)
    return [
        f"{found[0]} {text}"
        if len(found) == 1
        else f"{len(found)} captures from {found[0]} to {found[-1]}, each {text}"
        for text, found in captures.items()
    ]


def _figures(decoded: Decoded, captures: int, projector: tuple[int, int]) -> dict[str, Any]:
    """Figures of a decoded folder, ready for JSON."""
    h, w = decoded.reason.shape
    good = decoded.reason == 0
    share, residual_px = plane_figures(decoded.projector_xy, good)
    return {
        "captures": captures,
        "camera": [w, h],
        "projector": list(projector),
        "decoded": float(np.mean(good)),
        "rejected": {text: n / good.size for text, n in decoded.counts.items() if text != "decoded" and n},
        "confidence_median": float(np.median(decoded.confidence[good])) if good.any() else None,
        "plane": {"within_2_px": share, "residual_rms_px": residual_px},
        "mirrored": _mirrored(decoded.projector_xy),
    }


def _mirrored(projector_xy: NDArray[np.float32]) -> bool:
    """Whether the projection is seen mirrored: from behind or in a mirror, or with its highest bit exchanged."""
    down, right = (np.diff(projector_xy, axis=axis)[: -1 if axis else None, : None if axis else -1] for axis in (0, 1))
    turn = right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0]
    turn = turn[np.isfinite(turn)]
    return bool(turn.size) and float(np.median(turn)) < 0.0


def plane_figures(
    projector_xy: NDArray[np.float32], good: NDArray[np.bool_], seed: int = 0
) -> tuple[float | None, float | None]:
    """How well places lie on one plane: share within 2 projector pixels of the dominant homography, and rms of those.

    Found from samples of 4 of a few thousand places (RANSAC), then fitted to those within 2 pixels; None without any.
    """
    rows, columns = np.nonzero(good)
    if rows.size < 100:
        return None, None
    rng = np.random.default_rng(seed)
    camera = np.stack([columns, rows], axis=-1) / max(good.shape)
    places = projector_xy[rows, columns].astype(np.float64)
    few = rng.choice(rows.size, min(rows.size, 4000), replace=False)
    best, most = np.zeros(few.size, bool), 0
    for _ in range(300):
        four = rng.choice(few, 4, replace=False)
        near = _off_plane(_homography(camera[four], places[four]), camera[few], places[few]) < 2.0
        if near.sum() > most:
            best, most = near, int(near.sum())
    if most < 10:
        return None, None
    H = _homography(camera[few[best]], places[few[best]])
    for _ in range(3):
        near = _off_plane(H, camera[few], places[few]) < 2.0
        H = _homography(camera[few[near]], places[few[near]])
    off = _off_plane(H, camera, places)
    on = off < 2.0
    return float(np.mean(on)), float(np.sqrt(np.mean(off[on] ** 2))) if on.any() else None


def _homography(camera: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Homography (3, 3) from camera to projector by the smallest singular vector (direct linear transform)."""
    mean, scale = places.mean(axis=0), places.std() + 1e-9
    u, v = ((places - mean) / scale).T
    x = np.column_stack([camera, np.ones(len(camera))])
    none = np.zeros_like(x)
    rows = np.vstack([np.hstack([x, none, -u[:, None] * x]), np.hstack([none, x, -v[:, None] * x])])
    H = np.linalg.svd(rows.T @ rows)[2][-1].reshape(3, 3)
    return np.array([[scale, 0.0, mean[0]], [0.0, scale, mean[1]], [0.0, 0.0, 1.0]]) @ H


def _off_plane(H: NDArray[np.float64], camera: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each place from where the homography puts it, projector pixels."""
    mapped = np.column_stack([camera, np.ones(len(camera))]) @ H.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(np.hypot(*(mapped[:, :2] / mapped[:, 2:] - places).T), nan=np.inf)
