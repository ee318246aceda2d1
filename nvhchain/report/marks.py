"""Orders of cases that are marked in figures."""

from __future__ import annotations

from collections.abc import Sequence

from nvhchain.case import Case, GearboxCase
from nvhchain.plots.marks import OrderMarks, joined_orders


def order_marks(cases: Sequence[Case]) -> OrderMarks:
    """Return the mesh orders of all gearboxes, and the sidebands of their structured gears."""
    mesh, slots = joined_orders((case.name, mesh_orders(case), slot_orders(case)) for case in cases)
    return OrderMarks(mesh=mesh, slots=slots, slotted=tuple(case.name for case in cases if slot_orders(case)))


def mesh_orders(case: Case) -> dict[str, float]:
    """Return gear stage → mesh order of the input; empty for a radiator."""
    return {name: float(order) for name, order in case.mesh_orders.items()}


def slot_orders(case: Case) -> dict[str, float]:
    """Return gear stage → distance (orders) of the sidebands of its structured gear."""
    if not isinstance(case, GearboxCase):
        return {}
    gears = {gear.name: gear for gear in case.gears}
    return {
        stage.name: gear.blank.symmetry * float(case.shaft_orders[gear.rotor])
        for stage in case.stages
        for gear in (gears[stage.pinion], gears[stage.wheel])
        if gear.blank.symmetry > 2
    }
