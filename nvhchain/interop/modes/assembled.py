"""Modes on the nodes and elements of a file, as they come, to a `ModalModel`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.fem.modal_model import ModalModel
from nvhchain.handoff import FloatArray, IntArray
from nvhchain.interop.modes.uff_skin import select_rows, skin
from nvhchain.interop.notation.units import UnitSystem


@dataclass(frozen=True, eq=False)
class Mode:
    """Mode in units of the file: frequency, modal mass, damping, node labels (n,) and motion (n, 3)."""

    frequency: float
    mass: float
    damping: float
    labels: IntArray
    motion: FloatArray


@dataclass(frozen=True, eq=False)
class Geometry:
    """Nodes and elements that modes refer to, in units of the file.

    nodes: label → place (3,).
    elements: descriptor of dataset 2412 and labels of the nodes, of shells and solids.
    axes: label → axes (3, 3), as columns, in which the node moves; missing for global ones.
    subject: the table of elements as messages call it.
    """

    nodes: Mapping[int, list[float]]
    elements: list[tuple[int, list[int]]]
    axes: Mapping[int, FloatArray] = field(default_factory=dict)
    subject: str = "elements"


def modal_model(
    modes: list[Mode], geometry: Geometry, system: UnitSystem, source: str, *, mass_normalized: bool = False
) -> ModalModel:
    """Return modes with the skin of the elements, in SI; the list of modes is emptied.

    mass_normalized : True for shapes of modal mass 1, whatever the file states.

    Raises InputError for a mode without modal mass and for elements without a skin.
    """
    labels = np.array(sorted(geometry.nodes), dtype=np.int64)
    moves = np.ones(len(labels), dtype=bool)
    for mode in modes:
        moves &= np.isin(labels, mode.labels)
    place = system.length * np.array([geometry.nodes[int(label)] for label in labels])
    found = skin(geometry.elements, labels, place, moves, geometry.subject)
    modes.sort(key=lambda mode: mode.frequency)
    added = found.centres.shape[0]
    frequency, damping = (np.array([getattr(mode, name) for mode in modes]) for name in ("frequency", "damping"))
    shapes = np.zeros((len(modes), len(labels) + added, 3))
    turned = select_rows(labels, list(geometry.axes), f"{source}: a node")
    axes = np.array(list(geometry.axes.values())).reshape(-1, 3, 3)
    for shape in shapes:
        mode = modes.pop(0)  # released after the copy: modes may take gigabytes
        require(
            mass_normalized or mode.mass > 0,
            f"{source}: a mode has modal mass {mode.mass:g}: export shapes with their modal mass, or state "
            "mass_normalized = true if it is one",
        )
        mass = 1.0 if mass_normalized else mode.mass
        shape[select_rows(labels, mode.labels, f"{source}: a mode")] = mode.motion / np.sqrt(mass * system.mass)
        shape[turned] = np.einsum("nij,nj->ni", axes, shape[turned])
        shape[len(labels) :] = found.centres @ shape[: len(labels)]
    return ModalModel(
        nodes=np.vstack([place, found.centres @ place]),
        labels=np.concatenate([labels, labels[-1] + 1 + np.arange(added)]),
        triangles=found.triangles,
        two_sided=found.two_sided,
        frequency=frequency / system.time,
        damping=damping,
        shapes=shapes,
        source=source,
        notes=found.notes,
    )
