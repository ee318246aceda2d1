"""Writer of case files: a case as commented TOML that reads back to the same numbers."""

from __future__ import annotations

import dataclasses
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING
from pathlib import Path
from typing import Any, get_args

from nvhchain.case.blank_mesh import Mesh
from nvhchain.case.deviations import Topography
from nvhchain.case.fluctuation import SpeedRecord, TorqueRecord
from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.radiator import RadiatorCase
from nvhchain.case.toml.meanings import bare, classes, fields_in_files, is_union, keys, meanings, type_name
from nvhchain.dimensions import UNITS
from nvhchain.dynamics import Bearing
from nvhchain.errors import InputError, require, warn_caller
from nvhchain.files.atomic_write import write_output
from nvhchain.kinds import checked

_UNIT = re.compile(rf" \((?:{'|'.join(sorted({re.escape(unit) for unit, _ in UNITS.values()}))})\)")
"""SI unit in the meaning of a field."""

_RANGE = re.compile(r",? [-\d.e]+ … [-\d.e]+")
"""Limits in the meaning of a field."""

_WIDTH = 110
"""Longest line (characters) of a value with its comment beside it."""

_PLACED = (Mesh, SpeedRecord, Topography, TorqueRecord)
"""Classes whose `file` is a path from the working directory; that of others is a path from the case's folder."""

_BEARING_FIELDS = ("radial_stiffness", "axial_stiffness")
"""Fields that a file must give for a bearing without model, whatever their default."""


_OTHERS = (".rexsj", ".rexsz", ".json", ".xml", ".zip", ".yaml", ".yml")
"""Suffixes of files that no case is written to."""


@checked
def save_case(case: GearboxCase | RadiatorCase, path: str | Path) -> Path:
    """Write a case into a commented file that `load_case` reads back to an equal case, or as REXS.

    Parameters
    ----------
    case : Case
        Gearbox or radiator, also one that was built in Python.
    path : str or Path
        TOML file, or one that ends in .rexs; an existing one is replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If a value cannot be written, or a radiator is to be written as REXS.
    WriteError
        If the file cannot be written.

    Notes
    -----
    Fields at their default are excluded. Lengths, angles and speeds are written in the unit with the shortest digits
    that read back exactly. Files of the case, such as a mesh, stay where they are. Their paths become relative to the
    new file. `folder` of the case that is read back is the folder of the new file.

    REXS 1.4 holds shafts, gears, stages, bearings and the load. A `UserWarning` names the parts of the case that it
    does not hold, such as the housing.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    require(suffix not in _OTHERS, f"{path}: cases are written as TOML or REXS: end the name in .toml or .rexs")
    if suffix != ".rexs":
        kind = "gearbox" if isinstance(case, GearboxCase) else "radiator"
        lines = [
            "# Fields that are not here have their defaults: `nvhchain schema` lists them all.",
            f'kind = "{kind}"',
        ]
        written = "\n".join([*lines, *_Writer(Path(case.folder), path.parent).table(case, "")]) + "\n"
        return write_output(path, written.encode())
    if not isinstance(case, GearboxCase):
        raise InputError(f"{path}: {case.name} is a radiator, which REXS does not hold: end the name in .toml")
    from nvhchain.case.rexs import export_rexs  # the format is loaded where it is asked for

    left = export_rexs(case, path)
    if left:
        warn_caller(f"{path}; not in it: {', '.join(left)}", UserWarning)
    return path


class _Writer:
    """Lines of a case file; the meaning of a field stands beside its first value."""

    def __init__(self, folder: Path, target: Path) -> None:
        self._folder, self._target = folder, target
        self._explained: set[tuple[type, str]] = set()

    def table(self, owner: Any, path: str, choices: Iterable[type] = ()) -> Iterator[str]:
        """Yield the lines of a table: values, then the tables inside."""
        inside: list[tuple[str, Any, Any]] = []
        alternatives = list(choices)
        if len(alternatives) > 1:
            yield f'type = "{type_name(type(owner))}"'
        for name, hint, value in _stated(owner):
            if dataclasses.is_dataclass(value) or (not path and _is_list_of_tables(value)):
                inside.append((name, hint, value))
            else:
                given = self._place(owner, value) if name == "file" else value
                yield from self._line(type(owner), name, hint, given)
        for name, hint, value in inside:
            below = f"{path}.{name}" if path else name
            if dataclasses.is_dataclass(value):
                yield from ("",) if not path else ()
                yield f"[{below}]{self._comment(type(owner), name, '')}"
                yield from self.table(value, below, classes(hint))
            else:
                for item in value:
                    yield from ("", f"[[{below}]]")
                    yield from self.table(item, below)

    def _place(self, owner: Any, file: str) -> str:
        """Return the path of a file of the case from the folder of the written one."""
        path = Path(file) if isinstance(owner, _PLACED) else self._folder / file
        try:
            return Path(os.path.relpath(path, self._target)).as_posix()
        except ValueError:  # another drive
            return path.resolve().as_posix()

    def _line(self, cls: type, name: str, hint: Any, value: Any) -> Iterator[str]:
        key, text = _assignment(name, hint, value)
        comment = self._comment(cls, name, key)
        line = f"{key} = {text}"
        if "\n" in line:
            yield from ([comment.strip()] if comment else [])
            yield from line.splitlines()
        elif len(line + comment) <= _WIDTH:
            yield line + comment
        else:
            yield from (comment.strip(), line)

    def _comment(self, cls: type, name: str, key: str) -> str:
        """Return the first sentence of a field's meaning as a comment, once for all fields that share it."""
        text = meanings(cls).get(name, "").partition(". ")[0].rstrip(".")
        if (cls, text) in self._explained or name == "name" or not text:
            return ""
        self._explained.add((cls, text))
        if key.removeprefix(name):  # the key has the unit, and limits in SI do not fit it
            text = _RANGE.sub("", _UNIT.sub("", text))
        return f"  # {text}"


def _stated(owner: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield name, annotation and value of every field that differs from its default."""
    for field, hint in fields_in_files(type(owner)):
        value = getattr(owner, field.name)
        default = field.default if field.default_factory is MISSING else field.default_factory()
        needed = isinstance(owner, Bearing) and owner.model is None and field.name in _BEARING_FIELDS
        if needed or not (value == default and type(value) is type(default)):
            if value is None:
                raise InputError(f"{type(owner).__name__}.{field.name} = None cannot be written: give it a value")
            yield field.name, hint, value


def _is_list_of_tables(value: Any) -> bool:
    return isinstance(value, tuple | list) and bool(value) and dataclasses.is_dataclass(value[0])


def _assignment(name: str, hint: Any, value: Any) -> tuple[str, str]:
    """Return the key, with the unit of the fewest digits, and the text of a value; mm rather than µm or m."""
    bare_key, *common = keys(name, hint)
    rarely = {bare_key: 0.5, **dict.fromkeys(common[1:], 1.5)}
    texts = {key: _text(hint, value, factor) for key, factor in keys(name, hint).items()}
    exact = {key: text for key, text in texts.items() if text is not None}
    return min(exact.items(), key=lambda item: len(item[1]) + rarely.get(item[0], 0.0))


def _text(hint: Any, value: Any, factor: float = 1.0) -> str | None:
    """Return the text of a value in a unit; None if none of its numbers in that unit reads back exactly."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, int):
        return str(value) if factor == 1.0 else _number(float(value), factor)
    if isinstance(value, float):
        return _number(value, factor)
    if dataclasses.is_dataclass(value):
        parts = [f'type = "{type_name(type(value))}"'] if len(classes(hint)) > 1 else []
        parts += [" = ".join(_assignment(*item)) for item in _stated(value)]
        return f"{{ {', '.join(parts)} }}"
    if isinstance(value, Mapping) or not hasattr(value, "__iter__"):
        raise InputError(f"{value!r} has no form in a case file")
    inner = _entry(hint)
    texts = [_text(inner, item, factor) for item in value]
    if any(text is None for text in texts):
        return None
    if _is_list_of_tables(value):
        return "[\n" + "".join(f"    {text},\n" for text in texts) + "]"
    return f"[{', '.join(map(str, texts))}]"


def _entry(hint: Any) -> Any:
    """Return the annotation of the entries of a list."""
    plain = bare(hint)
    kinds = get_args(plain) if is_union(plain) else (plain,)
    return next((get_args(kind)[0] for kind in kinds if get_args(kind)), Any)


def _number(value: float, factor: float) -> str | None:
    """Return the shortest digits that read back to a number (SI) in a unit."""
    for digits in range(1, 18):
        text = f"{value / factor:.{digits}g}"
        if float(text) * factor == value:
            plain = repr(float(text))
            return plain.removesuffix(".0")
    return None
