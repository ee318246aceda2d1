"""Marked orders of a spectrum: mesh orders with their harmonics, and the sidebands due to slots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes

from nvhchain.errors import require
from nvhchain.handoff import FloatArray
from nvhchain.plots._style import MARK_LINES

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


def matching(orders: FloatArray, wanted: FloatArray) -> np.ndarray:
    """Return True for `orders` that are among `wanted`."""
    if not len(wanted):
        return np.zeros(len(orders), dtype=bool)
    return np.asarray(np.abs(orders[:, None] - wanted).min(axis=1) < MATCH)


def draw_mesh_orders(ax: Axes, marks: OrderMarks, input_frequency: float) -> None:
    """Draw vertical lines at the mesh harmonics of every stage within the frequency range (Hz) of `ax`."""
    highest = ax.get_xlim()[1] / input_frequency
    for index, (stage, order) in enumerate(marks.mesh.items()):
        grey, dashes = MARK_LINES[index % len(MARK_LINES)]
        for number, harmonic in enumerate(marks.harmonics(stage, highest)):
            ax.axvline(
                harmonic * input_frequency,
                color=grey,
                linestyle=dashes,
                linewidth=0.8,
                zorder=0.5,
                label=f"{stage}: order {order:g} × 1, 2, …" if number == 0 else None,
            )


def add_order_axis(ax: Axes, input_frequency: float) -> None:
    """Add the order of the input shaft along the top; `input_frequency` is in turns of the input shaft per second."""
    top = ax.secondary_xaxis(
        "top", functions=(lambda f: np.divide(f, input_frequency), lambda order: np.multiply(order, input_frequency))
    )
    top.set_xlabel("order of the input shaft")
