"""Orders that are marked in figures and named in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from nvhchain import plots
from nvhchain.case import Case, GearboxCase

NEAR = 0.02
"""Largest distance (orders) of a line from the order that gives it its name."""


def order_marks(cases: Sequence[Case]) -> plots.OrderMarks:
    """Return the mesh orders of the first gearbox, and the sidebands of structured gears in any of the cases."""
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    slots: dict[str, float] = {}
    for case in gearboxes:
        slots |= slot_orders(case)
    slotted = tuple(case.name for case in gearboxes if slot_orders(case))
    mesh = mesh_orders(gearboxes[0]) if gearboxes else {}
    return plots.OrderMarks(mesh=mesh, slots=slots, slotted=slotted)


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


def order_name(order: float, mesh: Mapping[str, float], slots: Mapping[str, float]) -> str:
    """Return the origin of an order of the input, such as "stage1 × 6"; empty where it has none."""
    found = []
    for stage, of_mesh in mesh.items():
        harmonic = round(order / of_mesh)
        if harmonic and abs(order - harmonic * of_mesh) < NEAR:
            found.append(f"{stage} × {harmonic}")
    if found:
        return " = ".join(found)
    for stage, spacing in slots.items():
        harmonic = round(order / mesh[stage])
        aside = round((order - harmonic * mesh[stage]) / spacing)
        if harmonic and abs(order - harmonic * mesh[stage] - aside * spacing) < NEAR:
            return f"{stage} × {harmonic} {'+' if aside > 0 else '−'} {abs(aside)} × slots"
    return ""
