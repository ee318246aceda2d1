"""Orders of cases that are marked in figures."""

from __future__ import annotations

from collections.abc import Sequence

from nvhchain.case import Case, GearboxCase
from nvhchain.plots.marks import OrderMarks


def order_marks(cases: Sequence[Case]) -> OrderMarks:
    """Return the mesh orders of the first gearbox, and the sidebands of structured gears in any of the cases."""
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    slots: dict[str, float] = {}
    for case in gearboxes:
        slots |= slot_orders(case)
    slotted = tuple(case.name for case in gearboxes if slot_orders(case))
    mesh = mesh_orders(gearboxes[0]) if gearboxes else {}
    return OrderMarks(mesh=mesh, slots=slots, slotted=slotted)


def mesh_orders(case: Case) -> dict[str, float]:
    """Return gear stage → mesh order of the input; empty for a radiator."""
    return {name: float(order) for name, order in case.mesh_orders.items()} if isinstance(case, GearboxCase) else {}


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
