"""`Settings` -> the text of a paxel.toml: every key, one a line, with its unit and choices in a comment.

And such a text with single keys changed.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any, Literal, get_args, get_origin

from paxel_runtime.settings.tables import ColorantSettings, Section, Settings

__all__ = ["change_toml", "settings_to_toml"]


def settings_to_toml(settings: Settings) -> str:
    """The text of a paxel.toml with every key, one a line, with its unit and choices in a comment."""
    lines = ["# A Paxel installation. Change a value, then run: paxel status", ""]
    for name in Settings.model_fields:
        if name != "colorants":
            section = getattr(settings, name)
            lines += [f"[{name}]  # {(type(section).__doc__ or '').rstrip('.')}", *_toml_lines(section), ""]
    lines += ["# Inks and papers of your own (white is the paper): a table [colorants.NAME] each, with", "#"]
    lines += [f"# {key:<13} {info.description}" for key, info in ColorantSettings.model_fields.items()] + [""]
    for name, colorant in settings.colorants.items():
        lines += [f"[colorants.{name}]", *_toml_lines(colorant, only=colorant.model_fields_set), ""]
    return "\n".join(lines)


def _toml_lines(section: Section, only: set[str] | None = None) -> list[str]:
    """The keys of a table, one a line, each with its comment; `only` those that are set, where absent is a value."""
    lines = []
    for key, info in type(section).model_fields.items():
        value = getattr(section, key)
        if only is not None and (key not in only or value is None):
            continue
        choices = _choices(info.annotation)
        lines.append(f"{f'{key} = {_toml_value(value)}':<40} # {info.description}{'; ' + choices if choices else ''}")
    return lines


def _choices(annotation: Any) -> str:
    return " | ".join(str(choice) for choice in get_args(annotation)) if get_origin(annotation) is Literal else ""


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_toml_value(v) for v in value) + "]"
    return repr(value)


def change_toml(text: str, values: dict[str, Any]) -> str:
    """A paxel.toml with some keys changed; every other line, and all comments, as they were.

    Parameters
    ----------
    text : str
        Of a paxel.toml that can be read.
    values : dict
        ``{"pattern.dot_size_mm": 0.5}``. A key or a table that is not there is added.
    """
    lines = text.splitlines()
    for key, value in values.items():
        table, name = key.split(".")
        headers = [k for k, line in enumerate(lines) if re.match(r"\s*\[", line)]
        start = next((k for k in headers if re.match(rf"\s*\[\s*{re.escape(table)}\s*\]", lines[k])), None)
        if start is None:
            lines += ["", f"[{table}]", f"{name} = {_toml_value(value)}"]
            continue
        stop = next((k for k in headers if k > start), len(lines))
        at = next((k for k in range(start + 1, stop) if re.match(rf"\s*{re.escape(name)}\s*=", lines[k])), None)
        if at is None:
            lines.insert(start + 1, f"{name} = {_toml_value(value)}")
            continue
        lines[at] = f"{f'{name} = {_toml_value(value)}':<40} {_comment(lines[at])}".rstrip()
    return "\n".join(lines) + "\n"


def _comment(line: str) -> str:
    """The comment behind a key and its value; a # may stand in a string too."""
    for k in (k for k, sign in enumerate(line) if sign == "#"):
        try:
            tomllib.loads(line[:k])
        except tomllib.TOMLDecodeError:
            continue
        return line[k:]
    return ""
