"""Files of REXS: XML (.rexs), JSON (.rexsj) and either of them in a ZIP archive (.rexsz)."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from nvhchain.errors import FileFormatError, InputError, require
from nvhchain.interop.rexs.contents._xml import parse_xml, value_of
from nvhchain.interop.rexs.contents.document import (
    Attribute,
    Component,
    Document,
    LoadCase,
    Relation,
    check_size,
    whole,
)
from nvhchain.interop.rexs.contents.names import attribute_name, component_name

LARGEST = 64 << 20
"""Largest size (bytes) of the XML or JSON."""

LARGEST_FILE = LARGEST
"""Largest size (bytes) of the file itself."""

NEWEST = (2, 0)
"""Newest version whose names are translated."""

_KEYS = ("id", "unit")


def read_document(path: str | Path) -> Document:
    """Read a REXS file.

    path: XML, JSON or ZIP, found by its contents.
    Returns components, relations and load cases, with the names of REXS 2.0.
    """
    name = str(path)
    try:
        with Path(path).open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"{name}: cannot be read ({error.strerror or error}): name a REXS file") from None
    if data[:4] == b"PK\x03\x04":
        data = _unzipped(data, name)
    require(
        len(data) <= LARGEST, f"{name}: is larger than {LARGEST >> 20} MiB: cut it to one gear unit without results"
    )
    start = data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
    if start == b"{":
        return _read_json(data, name)
    if start == b"<" or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return _read_xml(parse_xml(data, name), name)
    raise FileFormatError(f"{name}: is neither XML, JSON nor ZIP: export REXS (.rexs, .rexsj or .rexsz)")


def _unzipped(data: bytes, path: str) -> bytes:
    """Return the only model of an archive, unpacked to the largest size at most."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            # metadata of an operating system begins with a dot
            models = re.compile(r"(^|/)[^./][^/]*\.(rexsj?|xml|json)$", re.I)
            names = [entry for entry in archive.infolist() if models.search(entry.filename)]
            chosen = [entry for entry in names if re.search(r"\.rexsj?$", entry.filename, re.I)] or names
            require(
                len(chosen) == 1,
                f"{path}: the archive holds {len(chosen)} models (.rexs or .rexsj): put one into it",
            )
            with archive.open(chosen[0]) as file:
                return file.read(LARGEST + 1)
    except (zipfile.BadZipFile, EOFError, OSError, RuntimeError, NotImplementedError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise FileFormatError(f"{path}: a damaged or locked archive ({error}): pack it anew") from None
    except Exception as error:  # zlib.error and lzma.LZMAError have no common base
        raise FileFormatError(f"{path}: a damaged archive ({error}): pack it anew") from None


def _version(text: Any, path: str) -> tuple[int, int]:
    found = re.match(r"\s*(\d+)\.(\d+)", str(text))
    if not found:
        raise FileFormatError(f"{path}: version = {text!r} is none of REXS, such as 1.4: export the file anew")
    version = int(found[1]), int(found[2])
    require(
        version[0] in (1, 2),
        f"{path}: REXS {version[0]}.{version[1]} is unknown: export version 1.0 to {NEWEST[0]}.{NEWEST[1]}",
    )
    return version


def _read_xml(root: Element, path: str) -> Document:
    if root.tag != "model":
        raise FileFormatError(f"{path}: its root element is <{root.tag[:40]}>, that of REXS is <model>: export REXS")

    def attributes(element: Element) -> Iterator[tuple[Any, Any, Any]]:
        for child in element.iter("attribute"):
            yield child.get("id"), value_of(child), child.get("unit")

    relations = [
        (e.get("id"), e.get("type"), e.get("order"), [(ref.get("role"), ref.get("id")) for ref in e.iter("ref")])
        for e in root.iterfind("relations/relation")
    ]
    components = [
        (e.get("id"), e.get("type"), e.get("name"), attributes(e)) for e in root.iterfind("components/component")
    ]
    cases = [
        (
            spectrum.get("id", place),
            case.get("id"),
            [(e.get("id"), e.get("type"), attributes(e)) for e in case.iterfind("component")],
        )
        for place, spectrum in enumerate(root.iter("load_spectrum"), start=1)
        for case in spectrum.iter("load_case")
    ]
    return _document(path, root.get("version"), root.get("applicationId"), components, relations, cases)


def _read_json(data: bytes, path: str) -> Document:
    try:
        model = json.loads(data.decode("utf-8-sig"), parse_constant=lambda text: text)["model"]
        found = [
            (r.get("id"), r.get("type"), r.get("order"), [(ref.get("role"), ref.get("id")) for ref in r["refs"]])
            for r in model.get("relations") or ()
        ]
        components = [
            (c.get("id"), c.get("type"), c.get("name"), _json_attributes(c)) for c in model.get("components") or ()
        ]
        cases = [
            (
                spectrum.get("id", place),
                case.get("id"),
                [(c.get("id"), c.get("type"), _json_attributes(c)) for c in case.get("components") or ()],
            )
            for key, spectra in model.items()
            if key.startswith("load_spectr")
            for place, spectrum in enumerate(_listed(spectra), start=1)
            for case in spectrum.get("load_cases") or ()
        ]
        return _document(path, model.get("version"), model.get("applicationId"), components, found, cases)
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise FileFormatError(f"{path}: not valid JSON ({error}): export the file anew") from None
    except RecursionError:
        raise FileFormatError(f"{path}: JSON nested too deeply, which no gear unit is: export the file anew") from None
    except (KeyError, TypeError, AttributeError):
        raise FileFormatError(f"{path}: JSON without the objects of REXS (model, components, …): export REXS") from None


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value] if value else []


def _json_attributes(component: Any) -> Iterator[tuple[Any, Any, Any]]:
    for entry in component.get("attributes") or ():
        values = [value for key, value in entry.items() if key not in _KEYS]
        if not values:
            continue
        value = values[0]
        if isinstance(value, dict):
            value = (value.get("code"), value.get("value"))
        yield entry.get("id"), value, entry.get("unit")


def _document(
    path: str,
    version: Any,
    application: Any,
    components: Iterable[Any],
    relations: Iterable[Any],
    cases: Iterable[Any],
) -> Document:
    """Return the document with names of REXS 2.0, after checks of numbers and ends."""
    numbers = _version(version, path)

    def named(kind: str, entries: Iterable[Any]) -> dict[str, Attribute]:
        return {
            attribute_name(str(key), kind, numbers): Attribute(value, str(unit or "")) for key, value, unit in entries
        }

    parts: dict[int, Component] = {}
    for key, kind, name, entries in components:
        number = whole(key, "id of a component", path)
        if number in parts:
            raise FileFormatError(f"{path}: component {number} is there twice: export the file anew")
        kind = component_name(str(kind))
        parts[number] = Component(number, kind, " ".join(str(name or "").split()), named(kind, entries))
    check_size(len(parts), "components", path)
    require(bool(parts), f"{path}: holds no components: export a whole gear unit")
    found = []
    for key, kind, order, refs in relations:
        number = whole(key, "id of a relation", path)
        ends = tuple((str(role), whole(end, f"end of relation {number}", path)) for role, end in refs)
        missing = [str(end) for _, end in ends if end not in parts]
        if missing:
            raise FileFormatError(
                f"{path}: relation {number} ({kind}) names component {', '.join(missing)}, which is not in the file: "
                "export the file anew"
            )
        found.append(Relation(number, str(kind), whole(order or 0, "order of a relation", path), ends))
    check_size(len(found), "relations", path)
    loads: list[LoadCase] = []
    listed = list(cases)
    several = len({str(spectrum) for spectrum, *_ in listed}) > 1
    for spectrum, key, entries in listed:
        case_attributes = {}
        for number, _, attributes in entries:
            end = whole(number, "id of a component", path)
            if end in parts:
                case_attributes[end] = named(parts[end].type, attributes)
        name = str(whole(len(loads) + 1 if key is None else key, "id of a load case", path))
        name = f"{spectrum}.{name}" if several else name
        if any(load.name == name for load in loads):
            raise FileFormatError(f"{path}: load case {name} is there twice: give each case, or spectrum, its own id")
        loads.append(LoadCase(name, case_attributes))
    return Document(
        f"{numbers[0]}.{numbers[1]}",
        str(application or "an unnamed program"),
        parts,
        tuple(sorted(found, key=lambda relation: relation.order)),
        tuple(loads),
    )
