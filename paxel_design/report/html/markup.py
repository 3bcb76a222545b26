"""Texts -> HTML: tags with everything escaped, and quantities that tell where they come from.

Knows nothing of blocks or pages. Content that is passed to `tag` is markup; attributes and `text` take plain text.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping
from dataclasses import dataclass

from paxel_design.report.content import Quantity, filled, quoted, unit_words

__all__ = ["Wording", "escaped", "tag", "wording_of"]

_VOID = {"img", "link", "meta"}
"""Elements without content and end tag."""

_START, _MIDDLE, _END = "\x02", "\x1f", "\x03"
"""Control characters, which no text has, about a quantity while its text is escaped: start, name, middle, text, end."""

_MARKED = re.compile(f"{_START}([^{_MIDDLE}]*){_MIDDLE}([^{_END}]*){_END}")


def escaped(text: str) -> str:
    """Plain text as content of an element."""
    return html.escape(text, quote=False)


def tag(name: str, /, *content: str, **attributes: str | bool | None) -> str:
    """An element.

    Parameters
    ----------
    name : str
    *content : str
        Markup, joined.
    **attributes : str, bool or None
        Plain text; True writes the bare name, False and None leave it out. ``class_`` is class, ``aria_label`` is
        aria-label.
    """
    written = "".join(
        f" {_attribute_name(key)}" + ("" if value is True else f'="{html.escape(value)}"')
        for key, value in attributes.items()
        if value is not None and value is not False
    )
    if name in _VOID:
        return f"<{name}{written}>"
    return f"<{name}{written}>{''.join(content)}</{name}>"


def _attribute_name(key: str) -> str:
    return key.rstrip("_").replace("_", "-")


@dataclass(frozen=True)
class Wording:
    """Writes the texts of one report.

    Attributes
    ----------
    quantities : mapping of str to Quantity
        All of the report, by full name.
    marked : mapping of str to Quantity
        The same, each as its text between marks.
    """

    quantities: Mapping[str, Quantity]
    marked: Mapping[str, Quantity]

    def plain(self, text: str) -> str:
        """A text with its quantities written out, not escaped: for attributes."""
        return filled(text, self.quantities)

    def markup(self, text: str) -> str:
        """A text as HTML; a quantity is a span that says its name and source when pointed at.

        Raises
        ------
        InputError
            If the text names a quantity that is not there.
        """
        return _MARKED.sub(lambda match: self._quantity(*match.groups()), escaped(filled(text, self.marked)))

    def value(self, name: str) -> str:
        """A quantity with its unit, as HTML.

        Raises
        ------
        InputError
            If there is no such quantity.
        """
        unit = self.quantities[name].unit if name in self.quantities else ""
        return self.markup(f"{{{name}}}") + (f" {escaped(unit_words(unit))}" if unit else "")

    def _quantity(self, name: str, written: str) -> str:
        value, source = self.quantities[name].value, self.quantities[name].source
        words = isinstance(value, str) or (isinstance(value, tuple) and any(isinstance(part, str) for part in value))
        look = "quantity" if words else "quantity number"  # no line breaks within a number
        return tag("span", written, class_=look, title=f"{name}: {source}" if source else name)


def wording_of(quantities: Mapping[str, Quantity]) -> Wording:
    """What writes texts that name these quantities."""
    marked = {name: Quantity(f"{_START}{name}{_MIDDLE}{quoted(q)}{_END}") for name, q in quantities.items()}
    return Wording(dict(quantities), marked)
