"""Nodes, their axes, and elements of a Nastran deck, for modes that a file holds without them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nvhchain.conventions import Material
from nvhchain.errors import InputError
from nvhchain.interop.modes.assembled import Geometry
from nvhchain.interop.modes.uff_skin import SHELLS, SOLIDS
from nvhchain.interop.notation._texts import damaged, named
from nvhchain.interop.notation.units import unit_system
from nvhchain.interop.solids._model_parts import Parts
from nvhchain.interop.solids.nastran import read_grids, read_solids
from nvhchain.interop.solids.nastran_cards import cards, split_deck
from nvhchain.interop.solids.nastran_frames import Deck
from nvhchain.interop.solids.nastran_structure import read_shells

_SOLIDS = {"tet4": 111, "tet10": 118, "wedge6": 112, "wedge15": 113, "hex8": 115, "hex20": 116}
_SHELLS = {3: 91, 6: 92, 4: 94, 8: 95}
"""Kind of a solid, or number of nodes of a shell → descriptor of dataset 2412."""


def deck_geometry(path: Path) -> Geometry:
    """Read the geometry of a deck, whose other cards are ignored.

    Raises FileFormatError for a damaged file.
    """
    named_cards: dict[str, list[list[str]]] = {}
    with damaged(path, lambda error: f"not Nastran bulk data: {error}"):
        for card in cards(split_deck(path)[1]):
            named_cards.setdefault(card[0], []).append(card)
    return card_geometry(named_cards, str(path))


def card_geometry(named_cards: dict[str, list[list[str]]], source: str) -> Geometry:
    """Return the geometry of cards by name; FileFormatError for damaged ones."""
    parts = Parts(source)
    with damaged(source, lambda error: f"not Nastran bulk data: {named(error)}"):
        frames = read_grids(named_cards, parts)
        read_solids(named_cards, parts)
        read_shells(Deck(named_cards, parts, unit_system("m-kg-s"), frames, _no_material, 1.0))
        axes = {
            label: frames[number].axes_at(np.array(parts.nodes[label]))
            for label, number in parts.rotated.items()
            if label in parts.nodes
        }
    elements: list[tuple[int, list[int]]] = []
    for (kind, _), (_, rows) in parts.elements.items():
        _, corners, middles = SOLIDS[_SOLIDS[kind]]
        places = [*corners, *middles]
        elements += [(_SOLIDS[kind], _placed(row, places)) for row in rows]
    for shells in parts.structure.shells.values():
        for row in shells.nodes:
            corners, middles = SHELLS[_SHELLS[len(row)]]
            elements.append((_SHELLS[len(row)], _placed(row, [*corners, *middles])))
    nodes = {label: list(place) for label, place in parts.nodes.items()}
    return Geometry(nodes, elements, axes, f"{source}: elements")


def _placed(row: list[int], places: list[int]) -> list[int]:
    """Return nodes, corners first, in the order of dataset 2412."""
    found = [0] * len(row)
    for node, place in zip(row, places, strict=True):
        found[place] = node
    return found


def _no_material(number: str, section: str) -> Material:
    raise InputError(f"material {number} of {section} is not read: the skin has no materials")
