"""XML of REXS as plain trees, without document types, entities or deep nesting."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from nvhchain.errors import FileFormatError

DEEPEST = 40
"""Largest depth of nested elements."""

MOST_ELEMENTS = 3_000_000
"""Largest number of elements."""


def parse_xml(data: bytes, path: str) -> Element:
    """Return the root element."""
    builder, depth, count = TreeBuilder(), 0, 0

    def refused(*_: Any) -> int:
        raise FileFormatError(
            f"{path}: line {reader.CurrentLineNumber}: a document type or entity, which REXS does not have: remove it"
        )

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > DEEPEST or count > MOST_ELEMENTS:
            raise FileFormatError(
                f"{path}: line {reader.CurrentLineNumber}: more than {DEEPEST} nested or {MOST_ELEMENTS} elements, "
                "which no gear unit has: export the file anew"
            )
        builder.start(_plain(tag), {_plain(key): value for key, value in attributes.items()})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(_plain(tag))

    reader = expat.ParserCreate()
    reader.buffer_text = True
    reader.StartDoctypeDeclHandler = refused
    reader.EntityDeclHandler = refused
    reader.ExternalEntityRefHandler = refused
    reader.StartElementHandler = start
    reader.EndElementHandler = end
    reader.CharacterDataHandler = builder.data
    try:
        reader.Parse(data, True)
        return builder.close()
    except expat.ExpatError as error:
        raise FileFormatError(
            f"{path}: line {error.lineno}: not valid XML ({expat.ErrorString(error.code)}): export the file anew"
        ) from None
    except (LookupError, ValueError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(f"{path}: its text encoding cannot be read ({error}): save it as UTF-8") from None


def _plain(tag: str) -> str:
    return tag.rpartition(":")[2]


def value_of(element: Element) -> Any:
    """Return the text of an attribute, or its array or matrix as lists of texts.

    A coded array is a pair of its code and its text.
    """
    for child in element:
        if child.tag in ("array", "matrix", "array_of_arrays"):
            if child.get("code"):
                return (child.get("code"), "".join((child.text or "").split()))
            return _entries(child)
    return (element.text or "").strip()


def _entries(element: Element) -> list[Any]:
    return [_entries(child) if len(child) else (child.text or "").strip() for child in element]
