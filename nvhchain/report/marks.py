"""Orders that are marked in the figures of some cases."""

from __future__ import annotations

from collections.abc import Sequence

from nvhchain import plots
from nvhchain.case import Case, GearboxCase


def order_marks(cases: Sequence[Case]) -> plots.OrderMarks:
    """Return the mesh orders of the first gearbox, and the sidebands of structured gears in any of the cases."""
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    slots: dict[str, float] = {}
    slotted = []
    for case in gearboxes:
        gears = {gear.name: gear for gear in case.gears}
        for stage in case.stages:
            for gear in (gears[stage.pinion], gears[stage.wheel]):
                if gear.blank.symmetry > 2:
                    slots[stage.name] = gear.blank.symmetry * float(case.shaft_orders[gear.rotor])
                    slotted.append(case.name)
    mesh = {name: float(order) for name, order in gearboxes[0].mesh_orders.items()} if gearboxes else {}
    return plots.OrderMarks(mesh=mesh, slots=slots, slotted=tuple(slotted))
