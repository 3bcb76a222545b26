"""`Settings` -> the text of a paxel.toml: every key, one a line, with its unit and choices in a comment."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin

from paxel_runtime.settings.tables import ColorantSettings, Section, Settings

__all__ = ["settings_to_toml"]


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
