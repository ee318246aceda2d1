"""Making of the items of a gallery, with their numbers cached beside their pictures."""

from __future__ import annotations

import ast
import json
import os
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cache
from math import nan
from pathlib import Path

from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.files.result_cache import code_version, fingerprint
from nvhchain.gallery.item import Item, Numbers, Place

SHARED = "shared"
"""Name of the folder of intermediate results."""


@dataclass(frozen=True)
class Made:
    """Item with our numbers.

    item: figure or table.
    numbers: quantity → our number; empty for an item that has not been made.
    seconds: time that it took when it was computed (s).
    processor_seconds: time of all processors that it took (s), ended child processes included.
    failure: error that ended it.
    """

    item: Item
    numbers: Numbers
    seconds: float
    processor_seconds: float = 0.0
    failure: Exception | None = None

    @property
    def pending(self) -> bool:
        """True for an item that has not been made."""
        return not self.numbers

    @property
    def picture(self) -> str:
        """File name of the picture; empty for a table and for a pending item."""
        return f"{self.item.name}.png" if self.numbers and self.item.drawn else ""

    @property
    def missed(self) -> list[str]:
        """Quantities whose numbers deviate by more than the verdict states."""
        if not self.numbers:
            return []
        known = (*self.item.stated.items(), *self.item.ours.items())
        return [name for name, stated in known if not stated.holds(self.numbers.get(name, nan))]


def made_items(
    items: Sequence[Item],
    out: Path,
    *,
    fidelity: Fidelity,
    cases: Path,
    wanted: Collection[str] | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Made]:
    """Make items, or take what an earlier gallery of the same code and fidelity left.

    An item that fails does not stop the others.

    wanted: numbers of the items to make; the others are taken if they are there. By default all are made.
    progress: receives a line for each item that is wanted.
    """
    out = writable_folder(out, "out")
    shared = writable_folder(out / SHARED, "out")
    found = []
    for item in items:
        place = Place(out / f"{item.name}.png", shared, cases, fidelity)
        made, outcome = _cached(item, place), "cached"
        if wanted is None or item.number in wanted:
            if made.pending:
                made = _computed(item, place)
                outcome = f"failed: {made.failure}" if made.failure else f"{made.seconds:.1f} s"
            progress(f"{item.number}: {outcome}")
        found.append(made)
    return found


def _key(item: Item, place: Place) -> str:
    settings = [f"{name}={value}" for name, value in sorted(getattr(item.make, "keywords", {}).items())]
    code = making_code(Path(__file__).parent), *(code_version(package) for package in item.uses)
    return fingerprint(item.number, place.fidelity, *settings, *code)


@cache
def making_code(folder: Path) -> str:
    """Return a digest of the code in a folder; lists of items do not count, so that a verdict can be worded anew."""
    nodes = [node for path in sorted(folder.glob("*.py")) for node in ast.parse(path.read_text(encoding="utf-8")).body]
    return fingerprint(*(ast.dump(node) for node in nodes if not (isinstance(node, ast.Assign) and _lists_items(node))))


def _lists_items(node: ast.Assign) -> bool:
    return any(isinstance(target, ast.Name) and target.id == "ITEMS" for target in node.targets)


def _record(item: Item, place: Place) -> Path:
    return place.shared / f"{item.name}.json"


def _cached(item: Item, place: Place) -> Made:
    """Return an item with the numbers of an earlier gallery, without numbers where there are none."""
    try:
        kept = json.loads(_record(item, place).read_text(encoding="utf-8"))
        if kept["key"] == _key(item, place) and (place.picture.exists() or not item.drawn):
            numbers = {str(name): float(value) for name, value in kept["numbers"].items()}
            return Made(item, numbers, kept["seconds"], kept["processor_seconds"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass  # no record, or a damaged one: made again
    return Made(item, {}, 0.0)


def _computed(item: Item, place: Place) -> Made:
    start, used = time.perf_counter(), sum(os.times()[:4])
    try:
        numbers = item.make(place)
    except OSError:
        raise  # the folder cannot be written: no item can be made
    except Exception as error:
        return Made(item, {}, time.perf_counter() - start, failure=error)
    made = Made(item, numbers, time.perf_counter() - start, sum(os.times()[:4]) - used)
    seconds = {"seconds": made.seconds, "processor_seconds": made.processor_seconds}
    record = {"key": _key(item, place), "numbers": numbers} | seconds
    write_text(_record(item, place), json.dumps(record, indent=1) + "\n")
    return made
