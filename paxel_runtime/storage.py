"""Files: dataclass <-> .json / .npz / .tif, each with its schema and writer, each written whole or not at all.

This file knows formats; which file belongs to which stage stands in ``installation.py``.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.model.correction import Correction, Term
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.version import WRITER

__all__ = [
    "file_sha256",
    "load_model",
    "model_from_dict",
    "model_to_dict",
    "read_image",
    "read_json",
    "read_npz",
    "read_tiff",
    "write_atomically",
    "write_image",
    "write_json",
    "write_npz",
    "write_text",
    "write_tiff",
]


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a file beside `path`, then put it in place: no reader ever sees half a file."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}{path.suffix}")
    try:
        write(temporary)
        temporary.replace(path)
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text atomically."""
    write_atomically(path, lambda p: p.write_text(text, encoding="utf-8"))


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON object atomically, its writer first."""
    write_text(path, json.dumps({"writer": WRITER, **data}, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises
    ------
    InstallationError
        If the file is missing or damaged.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InstallationError(f"{path} is missing; see what to run next with: paxel status") from None
    except (OSError, ValueError) as error:
        raise InstallationError(f"{path} is damaged ({error}); make it anew with its stage's --force") from None
    if not isinstance(data, dict):
        raise InstallationError(f"{path} must hold a JSON object, got a {type(data).__name__}")
    return data


def write_npz(path: Path, **arrays: NDArray[Any]) -> None:
    """Write arrays atomically, compressed; the writer is one of them."""
    write_atomically(path, lambda p: np.savez_compressed(p, writer=np.array(WRITER), **arrays))  # type: ignore[arg-type]


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Read all arrays of an .npz.

    Raises
    ------
    InstallationError
        If the file is missing or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except FileNotFoundError:
        raise InstallationError(f"{path} is missing; see what to run next with: paxel status") from None
    except (OSError, ValueError, EOFError) as error:
        raise InstallationError(f"{path} is damaged ({error}); make it anew with its stage's --force") from None


def write_tiff(path: Path, picture: NDArray[np.uint16]) -> None:
    """Write a capture, (h, w) or (h, w, 3) uint16, uncompressed and atomically."""
    photometric = "rgb" if picture.ndim == 3 else "minisblack"
    write_atomically(path, lambda p: tifffile.imwrite(p, picture, photometric=photometric, software=WRITER))


def read_tiff(path: Path) -> NDArray[np.uint16]:
    """Read a capture.

    Raises
    ------
    InstallationError
        If the file is missing or no 16-bit TIFF.
    """
    try:
        picture = tifffile.imread(path)
    except FileNotFoundError:
        raise InstallationError(f"{path} is missing; capture it again with: paxel capture") from None
    except (OSError, ValueError, tifffile.TiffFileError) as error:
        raise InstallationError(f"{path} is no TIFF that can be read: {error}") from None
    if picture.dtype != np.uint16:
        raise InstallationError(f"{path} must be a 16-bit TIFF, got {picture.dtype}")
    return picture


def write_image(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write an 8-bit picture, (H, W) or (H, W, 3), as PNG, atomically."""
    write_atomically(path, lambda p: Image.fromarray(picture).save(p, format="PNG", compress_level=4))


def read_image(path: Path) -> NDArray[np.uint8]:
    """Read an 8-bit picture that Paxel wrote, (H, W) or (H, W, 3).

    Raises
    ------
    InstallationError
        If the file is missing or no picture.
    """
    try:
        with Image.open(path) as image:
            return np.asarray(image)
    except FileNotFoundError:
        raise InstallationError(f"{path} is missing; see what to run next with: paxel status") from None
    except OSError as error:
        raise InstallationError(f"{path} is no picture that can be read: {error}") from None


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def model_to_dict(model: PredictionModel) -> dict[str, Any]:
    """A prediction model as the documented ``model.json`` (design: section 4); A and black of one place."""
    data = {
        "schema": "paxel-model",
        "version": 1,
        "channels": list(model.channels),
        "clusters": list(model.clusters),
        "white_point_XYZ": model.white_point.tolist(),
        "surfaces": {name: {"A": s.A.tolist(), "black": s.black.tolist()} for name, s in model.surfaces.items()},
        "response": {
            name: {"code": code.tolist(), "linear": linear.tolist()}
            for name, code, linear in zip(model.channels, model.response.code, model.response.linear, strict=True)
        },
    }
    if model.correction is not None:
        data["correction"] = _correction_to_dict(model.correction, list(model.surfaces))
    return data


def model_from_dict(data: Mapping[str, Any], source: str = "model.json") -> PredictionModel:
    """A prediction model from the documented form.

    Raises
    ------
    InputError
        With the key, the rule and what was found.
    """
    if data.get("schema") != "paxel-model" or data.get("version") != 1:
        raise InputError(
            f'{source}: schema must be "paxel-model", version 1; '
            f"got {data.get('schema')!r}, version {data.get('version')!r}"
        )
    channels, clusters = _names(data, "channels", source), _names(data, "clusters", source)
    n = len(channels) * len(clusters)
    surfaces = data.get("surfaces")
    if not isinstance(surfaces, dict) or "pattern" not in surfaces or not set(surfaces) <= {"pattern", "white"}:
        raise InputError(f'{source}: surfaces must hold "pattern" and, where there are two, "white"')
    models = {
        name: SurfaceModel(
            A=_numbers(entry, "A", (3, n), f"{source}: surfaces.{name}"),
            black=_numbers(entry, "black", (3,), f"{source}: surfaces.{name}"),
        )
        for name, entry in surfaces.items()
    }
    white_point = _numbers(data, "white_point_XYZ", (3,), source)
    if not np.all(white_point > 0):
        raise InputError(f"{source}: white_point_XYZ must be > 0, got {white_point.tolist()}")
    return PredictionModel(
        channels,
        clusters,
        models["pattern"],
        models.get("white"),
        white_point,
        _response(data, channels, source),
        _correction(data["correction"], n, list(models), f"{source}: correction") if "correction" in data else None,
    )


def load_model(path: str | os.PathLike[str]) -> PredictionModel:
    """Read a ``model.json``: an installation's, or one written by others from their own measurements.

    Raises
    ------
    InputError
        If the file is missing, no JSON, or breaks a rule of the format (the key, the rule, what was found).
    """
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"there is no model file {path}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} is no JSON that can be read: {error}") from None
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold a JSON object, got a {type(data).__name__}")
    return model_from_dict(data, source=path.name)


def _names(data: Mapping[str, Any], key: str, source: str) -> tuple[str, ...]:
    names = data.get(key)
    if not isinstance(names, list) or not names or not all(isinstance(n, str) and n for n in names):
        raise InputError(f"{source}: {key} must be a list of names, got {names!r}")
    if len(set(names)) != len(names):
        raise InputError(f"{source}: {key} must not name one twice, got {names!r}")
    return tuple(names)


def _numbers(data: Any, key: str, shape: tuple[int, ...], source: str) -> NDArray[np.float64]:
    try:
        values = np.array(data[key], dtype=np.float64)
    except (KeyError, TypeError):
        raise InputError(f"{source}: {key} is missing") from None
    except ValueError:
        raise InputError(f"{source}: {key} must be numbers in shape {shape}") from None
    if values.shape != shape or not np.all(np.isfinite(values)):
        found = f"shape {values.shape}" if values.shape != shape else "numbers that are not finite"
        raise InputError(f"{source}: {key} must be finite numbers in shape {shape}, got {found}")
    return values


def _response(data: Mapping[str, Any], channels: tuple[str, ...], source: str) -> ProjectorResponse:
    entries = data.get("response")
    if not isinstance(entries, dict) or set(entries) != set(channels):
        raise InputError(f"{source}: response must hold one curve for each of {', '.join(channels)}")
    codes, linears = [], []
    for name in channels:
        try:
            codes.append(np.asarray(entries[name]["code"], dtype=np.float64))
            linears.append(np.asarray(entries[name]["linear"], dtype=np.float64))
            ProjectorResponse((codes[-1],), (linears[-1],))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{source}: response.{name}: {error}") from None
    return ProjectorResponse(tuple(codes), tuple(linears))


def _correction_to_dict(correction: Correction, surfaces: list[str]) -> dict[str, Any]:
    """``terms`` as [kind, input a, input b] (`model.correction.TERM_KINDS`); XYZ of each in 3 rows a surface."""
    return {
        "terms": [list(term) for term in correction.terms],
        "centres": correction.centres.tolist(),
        "surfaces": {
            name: {"coefficients": C.tolist(), "weights": W.tolist()}
            for name, C, W in zip(surfaces, correction.coefficients, correction.weights, strict=True)
        },
    }


def _correction(data: Any, n: int, surfaces: list[str], source: str) -> Correction:
    try:
        terms = tuple(Term(str(kind), int(a), int(b)) for kind, a, b in data["terms"])
        centres, given = data.get("centres", []), data["surfaces"]
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError(f'{source} must hold "terms" ([kind, input, input] each) and "surfaces"') from None
    if not isinstance(given, dict) or set(given) != set(surfaces):
        raise InputError(f"{source}: surfaces must be those of the model, {' and '.join(surfaces)}")
    q = len(centres) if isinstance(centres, list) else 0
    return Correction(
        n=n,
        terms=terms,
        coefficients=np.stack(
            [_rows(given[name], "coefficients", len(terms), f"{source}.{name}") for name in surfaces]
        ),
        centres=_numbers(data, "centres", (q, n), source) if q else np.empty((0, n)),
        weights=np.stack([_rows(given[name], "weights", q, f"{source}.{name}") for name in surfaces]),
    )


def _rows(data: Any, key: str, columns: int, source: str) -> NDArray[np.float64]:
    """3 rows of numbers; absent is allowed where there is no column."""
    if not columns:
        return np.empty((3, 0))
    return _numbers(data, key, (3, columns), source)
