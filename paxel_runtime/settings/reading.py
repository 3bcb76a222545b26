"""A person's values -> `Settings`, or one line of text a mistake: the key, the rule, the value found and the line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from paxel_runtime.errors import SettingsError
from paxel_runtime.settings.presets import PRESETS
from paxel_runtime.settings.tables import ColorantSettings, Settings

__all__ = ["load_settings", "make_settings"]


def make_settings(preset: str = "bw-checkerboard", overrides: dict[str, Any] | None = None) -> Settings:
    """Settings of a preset with single keys changed.

    Parameters
    ----------
    preset : str
        A key of `PRESETS`.
    overrides : dict, optional
        ``{"pattern.dot_size_mm": 0.5}``.

    Raises
    ------
    SettingsError
        If the preset or a key is unknown, or a value breaks its rule.
    """
    if preset not in PRESETS:
        raise SettingsError(f"--preset must be one of {', '.join(PRESETS)}, got {preset!r}")
    nested: dict[str, dict[str, Any]] = {}
    for key, value in {**PRESETS[preset], **(overrides or {})}.items():
        *path, name = key.split(".")
        if not all((*path, name)) or len(path) != _tables_deep(path):
            raise SettingsError(f"a key is written section.name, such as pattern.dot_size_mm; got {key!r}")
        table = nested
        for part in path:
            table = table.setdefault(part, {})
        table[name] = value
    return _validate(nested, source="--set", text=None)


def load_settings(path: Path) -> Settings:
    """Read and check a paxel.toml.

    Raises
    ------
    SettingsError
        With the key, the rule, the value found and the line.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SettingsError(f"{path}: there is no paxel.toml here; make one with: paxel new {path.parent}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path} cannot be read as UTF-8 text: {error}") from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(f"{path.name} is not TOML: {error}") from None
    return _validate(data, source=path.name, text=text)


def _validate(data: dict[str, Any], *, source: str, text: str | None) -> Settings:
    try:
        return Settings.model_validate(data)
    except ValidationError as error:
        lines = dict.fromkeys(_explain(e, source, text) for e in error.errors())  # one line a rule
        raise SettingsError("\n".join(lines)) from None


def _explain(error: Any, source: str, text: str | None) -> str:
    """One pydantic error as `source: key rule, got value (line)`."""
    location = [str(part) for part in error["loc"]]
    deep = _tables_deep(location)
    key = ".".join(location[: deep + 1]) + "".join(f"[{part}]" for part in location[deep + 1 :])
    line = _line_of(location, text)
    where = f" (line {line})" if line else ""
    if error["type"] == "extra_forbidden":
        return f"{source}: {key} is not a known key{where}; {_known_keys(location)}"
    if error["type"] == "missing" and len(location) > deep + 1:
        key = ".".join(location[: deep + 1])
        return f"{source}: {key} must have more values, got {error['input']!r}{where}"
    if error["type"] == "model_type":
        return f"{source}: {key} must be a table, written [{key}], got {error['input']!r}{where}"
    if error["type"] == "value_error":  # our own rules: the message holds rule and value
        message = str(error["ctx"]["error"])
        if text:  # the rule may be about another key than the section it stands in
            keys = [k for k in re.findall(r"\b(?:\w+\.)?\w+\b", message) if _line_of(_path_in(location, k), text)]
            line = _line_of(_path_in(location, keys[0]), text) if keys else line
        where = f" (line {line})" if line else ""
        prefix = "".join(f"{part}." for part in location[:deep])
        return f"{source}: {prefix}{message}{where}"
    rule = re.sub(r"^Input should be |^Value should ", "", error["msg"])
    for words, sign in (
        ("greater than or equal to", ">="),
        ("less than or equal to", "<="),
        ("greater than", ">"),
        ("less than", "<"),
    ):
        rule = rule.replace(words, sign)
    rule = rule.split(", unable")[0].replace("'", '"')
    return f"{source}: {key} must be {rule}, got {error['input']!r}{where}"


def _path_in(location: list[str], key: str) -> list[str]:
    return key.split(".") if "." in key else [*location[: _tables_deep(location)], key]


def _tables_deep(location: Sequence[str]) -> int:
    """How many parts of a key's path name its table: ``[pattern]``, ``[colorants.silver]``."""
    return 2 if location and location[0] == "colorants" else 1


def _known_keys(location: list[str]) -> str:
    sections = Settings.model_fields
    if len(location) == 1 or location[0] not in sections:
        return f"the tables are {', '.join(f'[{name}]' for name in sections)}"
    model = ColorantSettings if location[0] == "colorants" else sections[location[0]].annotation
    fields = model.model_fields  # type: ignore[union-attr]
    return f"[{'.'.join(location[: _tables_deep(location)])}] has {', '.join(fields)}"


def _line_of(location: list[str], text: str | None) -> int | None:
    """Line of `[section] key = ...` in the file: every key stands alone on a line under its table."""
    if text is None or not location:
        return None
    section, found = "", None
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[\s*([\w.-]+)\s*\]", line):
            section = header.group(1)
            if section == ".".join(location[: _tables_deep(location)]):
                found = number
        elif len(location) > 1 and (key := re.match(r"\s*([\w.-]+)\s*=", line)):
            path = [part for part in (*section.split("."), *key.group(1).split(".")) if part]
            if path == location[: _tables_deep(location) + 1]:
                return number
        elif not section and re.match(rf"\s*{re.escape(location[0])}\s*=", line):
            return number
    return found
