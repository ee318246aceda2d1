"""Names and numbers that a file can hold, and marks of the original ones in its comments.

A mark is `nvhchain KIND NOW BEFORE`. It gives the name behind a Nastran number, or the name or number that the format
cannot hold. Other programs ignore comments; our readers restore the originals.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.solid_model import SolidModel
from nvhchain.handoff import IntArray

LARGEST_LABEL = 99_999_999
"""Largest label in Nastran: eight digits, the width of a small field."""

_LONGEST_NAME = 80
"""Largest number of characters of an Abaqus name."""

Marks = Mapping[str, Mapping[str, str]]
"""Kind → text in the file → original."""


def mark(comment: str, kind: str, now: object, original: object) -> str:
    """Return a mark as one line; `comment` starts a comment, `$` or `**`."""
    return f"{comment} nvhchain {kind} {now} {original}"


def marks(lines: Iterable[str]) -> Marks:
    """Return all marks among the lines of a file."""
    found: defaultdict[str, dict[str, str]] = defaultdict(dict)
    for line in lines:
        if "nvhchain" in line and (hit := re.match(r"\s*(?:\$|\*\*)\s*nvhchain (\w+) (\S+) (.+?)\s*$", line)):
            found[hit[1]][hit[2]] = hit[3]
    return found


def short_labels(labels: IntArray) -> IntArray:
    """Return labels of at most eight digits: longer ones go on from the largest other one, or into gaps below it.

    Raises InputError if there are more labels than numbers.
    """
    long = labels > LARGEST_LABEL
    if not long.any():
        return labels
    count, kept = int(long.sum()), labels[~long]
    require(len(labels) <= LARGEST_LABEL, f"{len(labels)} labels do not fit into 1 … {LARGEST_LABEL}")
    first = int(kept.max(initial=0)) + 1
    if first + count - 1 <= LARGEST_LABEL:
        free = np.arange(first, first + count)
    else:
        free = np.setdiff1d(np.arange(1, 2 * len(labels) + 1), kept)[:count]
    result = labels.copy()
    result[long] = free
    return result


def renumbered(model: SolidModel, nodes: Mapping[int, int], elements: Mapping[int, int]) -> SolidModel:
    """Return the model with new labels of nodes, reference points included, and of elements; others stay."""

    def new(labels: IntArray, table: Mapping[int, int]) -> IntArray:
        return np.array([table.get(label, label) for label in labels.tolist()], dtype=np.int64)

    if not nodes and not elements:
        return model
    return replace(
        model,
        labels=new(model.labels, nodes),
        blocks=tuple(replace(block, labels=new(block.labels, elements)) for block in model.blocks),
        rigid_sets=tuple(replace(rigid, label=nodes.get(rigid.label, rigid.label)) for rigid in model.rigid_sets),
    )


def restored(model: SolidModel, found: Marks) -> SolidModel:
    """Return the model with the labels of nodes and elements and the names in the marks."""
    nodes, elements = (
        {int(now): int(before) for now, before in found.get(kind, {}).items()} for kind in ("node", "element")
    )
    groups, bodies, sections = (found.get(kind, {}) for kind in ("group", "rigid", "property"))
    return renumbered(
        replace(
            model,
            blocks=tuple(replace(block, group=sections.get(block.group, block.group)) for block in model.blocks),
            rigid_sets=tuple(replace(rigid, name=bodies.get(rigid.name, rigid.name)) for rigid in model.rigid_sets),
            groups={groups.get(name, name): members for name, members in model.groups.items()},
        ),
        nodes,
        elements,
    )


def abaqus_names(names: Iterable[str]) -> list[str]:
    """Return distinct names, regardless of case, of letters, digits, `_` and `-` that start with a letter."""
    result: list[str] = []
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", name)
        plain = (plain if plain[:1].isalpha() else f"N{plain}")[: _LONGEST_NAME - 20]
        unique, number = plain, 1
        while unique.upper() in taken:
            number += 1
            unique = f"{plain}-{number}"
        taken.add(unique.upper())
        result.append(unique)
    return result


def changed(comment: str, kind: str, originals: Iterable[object], now: Iterable[object]) -> Iterator[str]:
    """Yield marks of all names or numbers that differ from the originals."""
    return (mark(comment, kind, new, old) for old, new in zip(originals, now, strict=True) if new != old)
