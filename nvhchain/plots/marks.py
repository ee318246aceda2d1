"""Colours of configurations, and orders of the input to mark and to name; without matplotlib."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from nvhchain.errors import require
from nvhchain.handoff import FloatArray

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Palette of Okabe and Ito, in the order of the configurations."""

NEAR = 0.02
"""Largest distance (orders) of a line from the order that gives it its name."""


MATCH = 1e-3
"""Largest distance of equal orders; lines of the steady spectrum are 2/41 of an order apart."""


@dataclass(frozen=True)
class OrderMarks:
    """Orders of the input shaft to mark.

    Parameters
    ----------
    mesh : mapping of str to float
        Stage → its mesh order.
    slots : mapping of str to float
        Stage → distance (orders) of its sidebands: slots per turn of their gear times that shaft's order.
    sidebands : int
        Number on each side of a mesh harmonic.
    slotted : tuple of str, optional
        Configurations with slots, whose sidebands are marked; all by default.
    """

    mesh: Mapping[str, float] = field(default_factory=dict)
    slots: Mapping[str, float] = field(default_factory=dict)
    sidebands: int = 2
    slotted: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        for name, order in (*self.mesh.items(), *self.slots.items()):
            require(order > 0, f"order of {name!r} is {order:g}: it must be positive")
        unknown = set(self.slots) - set(self.mesh)
        require(not unknown, f"slots of {sorted(unknown)} belong to no mesh: the stages are {sorted(self.mesh)}")

    def harmonics(self, stage: str, highest: float) -> FloatArray:
        """Return mesh orders 1 ×, 2 ×, … of `stage` up to order `highest`."""
        return self.mesh[stage] * np.arange(1.0, int(highest / self.mesh[stage] + MATCH) + 1)

    def mesh_orders(self, highest: float) -> FloatArray:
        """Return mesh harmonics of all stages up to `highest`, sorted."""
        orders = [self.harmonics(stage, highest) for stage in self.mesh]
        return np.unique(np.concatenate(orders)) if orders else np.empty(0)

    def sideband_orders(self, highest: float) -> FloatArray:
        """Return slot sidebands up to `highest`, sorted, without those that fall on a mesh harmonic."""
        found = []
        for stage, spacing in self.slots.items():
            steps = spacing * np.r_[-self.sidebands : 0, 1 : self.sidebands + 1]
            found.append((self.harmonics(stage, highest + self.sidebands * spacing)[:, None] + steps).ravel())
        orders = np.unique(np.round(np.concatenate(found), 9)) if found else np.empty(0)
        orders = orders[(orders > 0) & (orders <= highest + MATCH)]
        return orders[~matching(orders, self.mesh_orders(highest))]


def joined_orders(
    designs: Iterable[tuple[str, Mapping[str, float], Mapping[str, float]]],
) -> tuple[dict[str, float], dict[str, float]]:
    """Return mesh orders and slot spacings of several designs, each with its name, mesh orders and spacings.

    A stage that another design has with another order is named after its own design, too.
    """
    mesh, slots = dict[str, float](), dict[str, float]()
    for design, orders, spacings in designs:
        for stage, order in orders.items():
            name = stage if abs(mesh.get(stage, order) - order) < MATCH else f"{stage} of {design}"
            mesh[name] = order
            slots |= {name: spacings[stage]} if stage in spacings else {}
    return mesh, slots


def matching(orders: FloatArray, wanted: FloatArray) -> np.ndarray:
    """Return True for `orders` that are among `wanted`."""
    if not len(wanted):
        return np.zeros(len(orders), dtype=bool)
    return np.asarray(np.abs(orders[:, None] - wanted).min(axis=1) < MATCH)


def order_name(order: float, mesh: Mapping[str, float], slots: Mapping[str, float]) -> str:
    """Return the origin of an order of the input, such as "stage1 × 6"; empty where it has none."""
    found = []
    for stage, mesh_order in mesh.items():
        harmonic = round(order / mesh_order)
        if harmonic and abs(order - harmonic * mesh_order) < NEAR:
            found.append(f"{stage} × {harmonic}")
    if found:
        return " = ".join(found)
    for stage, spacing in slots.items():
        harmonic = round(order / mesh[stage])
        aside = round((order - harmonic * mesh[stage]) / spacing)
        if harmonic and abs(order - harmonic * mesh[stage] - aside * spacing) < NEAR:
            return f"{stage} × {harmonic} {'+' if aside > 0 else '−'} {abs(aside)} × slots"
    return ""
