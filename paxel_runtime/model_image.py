"""The image-based model on disk: ``model-image/`` beside model.json, written field by field, read memory-mapped.

For each surface ``<surface>.npy``, A as (H, W, 3, n) float16, and ``<surface>-black.npy``, (H, W, 3); model.json
holds their median over the pattern, and names the folder under "image". float16 keeps 11 bits: dE00 0.03 at most.
Memory: a tile of rows at a time, whatever the size of the picture.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.lib.format import open_memmap
from numpy.typing import NDArray

from paxel_runtime.calibration.image_model import Fields
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.storage import load_model, read_json

__all__ = ["load_image_model", "median_model", "write_model_image"]

FOLDER = "model-image"

_TILE_BYTES = 64 * 2**20
_MEDIAN_PIXELS = 500_000
_HIGHEST = float(np.finfo(np.float16).max)


def write_model_image(folder: Path, fields: Iterable[Fields], n: int) -> None:
    """Write every field into its place in ``folder/model-image``.

    Parameters
    ----------
    folder : Path
        Where model.json will be.
    fields : iterable of Fields
        One is held at a time.
    n : int
        Number of inputs.
    """
    target = folder / FOLDER
    target.mkdir(exist_ok=True)
    for field in fields:
        height, width, _ = field.XYZ.shape
        black = field.input is None
        path = target / (f"{field.surface}-black.npy" if black else f"{field.surface}.npy")
        if not path.exists():
            shape = (height, width, 3) if black else (height, width, 3, n)
            open_memmap(path, mode="w+", dtype=np.float16, shape=shape).flush()
        for rows in _tiles(height, width, 1 if black else n):
            array = open_memmap(path, mode="r+")  # anew for each tile: what was written is no longer in memory
            part = np.clip(field.XYZ[rows], -_HIGHEST, _HIGHEST)
            array[(rows, ...) if black else (rows, slice(None), slice(None), field.input)] = part
            array.flush()
            del array


def median_model(model: PredictionModel, folder: Path, inside: NDArray[np.bool_]) -> PredictionModel:
    """The spectral form of an image-based model: its median A and black over the pattern (design: section 7).

    Parameters
    ----------
    model : PredictionModel
        Gives names, response and white point.
    folder : Path
        As given to `write_model_image`.
    inside : (H, W) bool array
        Pixels of the pattern; at most 500,000 of them, evenly spread, are looked at.
    """
    places = np.flatnonzero(inside)
    places = places[:: max(1, len(places) // _MEDIAN_PIXELS)]
    surfaces = {}
    for name in model.surfaces:
        black = _median(folder / FOLDER / f"{name}-black.npy", places)
        surfaces[name] = SurfaceModel(_median(folder / FOLDER / f"{name}.npy", places), black)
    return replace(model, pattern=surfaces["pattern"], white=surfaces.get("white"), correction=None)


def load_image_model(path: str | os.PathLike[str]) -> PredictionModel:
    """The image-based model of an installation, memory-mapped: nothing is read before it is used.

    Parameters
    ----------
    path : path of a model.json, or of the folder that holds it
        A model.json with the key "image".

    Returns
    -------
    PredictionModel
        Its surfaces' A are (H, W, 3, n), black (H, W, 3), float16; `PredictionModel.at` gives the model of some pixels.

    Raises
    ------
    InputError
        If the model is not image-based, or a file is missing or does not fit the model.
    """
    path = Path(path)
    path = path / "model.json" if path.is_dir() else path
    model = load_model(path)
    folder = read_json(path).get("image")
    if not isinstance(folder, str) or Path(folder).name != folder:
        raise InputError(
            f'{path} has no "image": it is a spectral model; set [model] kind = "image", then run: paxel calibrate'
        )
    surfaces = {}
    for name in model.surfaces:
        A = _open(path.parent / folder / f"{name}.npy", (3, model.n))
        surfaces[name] = SurfaceModel(A, _open(path.parent / folder / f"{name}-black.npy", (3,)))
        if surfaces[name].black.shape[:2] != A.shape[:2] != surfaces["pattern"].A.shape[:2]:
            raise InputError(f"{path.parent / folder}: the files must be of one size; run: paxel calibrate --force")
    return replace(model, pattern=surfaces["pattern"], white=surfaces.get("white"), correction=None)


def _open(path: Path, inner: tuple[int, ...]) -> NDArray[np.float16]:
    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except FileNotFoundError:
        raise InputError(f"{path} is missing; make it with: paxel calibrate --force") from None
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path} is damaged ({error}); make it anew with: paxel calibrate --force") from None
    if array.shape[2:] != inner or array.dtype != np.float16:
        raise InputError(
            f"{path} must be (H, W, {', '.join(map(str, inner))}) float16, got {array.shape} {array.dtype}"
        )
    return array


def _median(path: Path, places: NDArray[np.int64]) -> NDArray[np.float64]:
    """Median of each value over some pixels, given by their places in the flattened picture, rising."""
    height, width, *inner = np.load(path, mmap_mode="r").shape
    picked = np.empty((len(places), *inner), np.float16)
    for rows in _tiles(height, width, int(np.prod(inner)) // 3):
        tile = np.load(path, mmap_mode="r")[rows].reshape(-1, *inner)
        first, last = np.searchsorted(places, [rows.start * width, rows.stop * width])
        picked[first:last] = tile[places[first:last] - rows.start * width]
    values = np.empty(inner)
    for index in np.ndindex(*inner):
        values[index] = np.median(picked[(slice(None), *index)].astype(np.float64))
    return values


def _tiles(height: int, width: int, n: int) -> Iterator[slice]:
    """Bands of whole rows, of about 64 MiB of float16 with n inputs each."""
    rows = max(1, _TILE_BYTES // (width * 3 * n * 2))
    for start in range(0, height, rows):
        yield slice(start, min(start + rows, height))
