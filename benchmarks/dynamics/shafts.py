"""Change of the bearing forces of the small case by flexible shafts, part by part.

    python -m benchmarks shafts OUT

Writes docs/measured/dynamics/shafts.md. OUT: folder for the operators of the case. Rotors that sit at their gears
(`coupling_z`) leave no twist. Statics is that of the textbook: a beam on two supports, loaded between them, with shear
(Cowper). That forces of flexible shafts are those of the exact differential equations is a test
(tests/dynamics/test_geared_flexible_shafts.py).
"""

from __future__ import annotations

import sys
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

import nvhchain as nvh
from benchmarks.dynamics.models import ROOT
from benchmarks.publish import publish
from nvhchain import dynamics
from nvhchain.case import GearboxCase
from nvhchain.dynamics import Bearing, Shaft
from nvhchain.dynamics.model.shaft_beam import elastic_shaft
from nvhchain.dynamics.time_loop.simulation import simulation
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray


def textbook(case: GearboxCase) -> list[list[Any]]:
    """By shaft: m/N of its bearings, of its bending at the gear by the textbook and by the code, and of its twist.

    Of a shaft of one diameter: a² b²/(3 E I l) + a b/(κ G A l) for a force at a and b from the supports.
    """
    rows = []
    for shaft, gear, pair_radius in zip(case.shafts, case.gears, case.pairs[0].base_radius, strict=True):
        (tube,) = shaft.segments
        bearings = [bearing for bearing in case.bearings if bearing.shaft == shaft.name]
        first, second = bearings
        a, b, span = gear.z - first.z, second.z - gear.z, second.z - first.z
        radius, nu = 0.5 * tube.outer_diameter, tube.poisson
        shear = tube.young / (2.0 * (1.0 + nu))
        bend, area = tube.young * pi * radius**4 / 4.0, pi * radius**2
        kappa = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu)
        beam = a**2 * b**2 / (3.0 * bend * span) + a * b / (kappa * shear * area * span)
        seats = ((b / span) ** 2 + (a / span) ** 2) / first.radial_stiffness
        twist = (gear.z - shaft.torque_plane) / (shear * pi * radius**4 / 2.0) * pair_radius**2
        rows.append([shaft.name, seats, beam, seats * bending_share(shaft, bearings, gear.z), twist])
    return rows


ELEMENT = 1.0
"""Length (m) of a beam element; the static deflection at its nodes is exact for any length."""


def bending_share(shaft: Shaft, bearings: list[Bearing], z: float) -> float:
    """Return the additional deflection of a shaft at `z` (m) under a radial force there, relative to a rigid shaft.

    Both shafts run in the same bearings. The value is 0 for a shaft whose segments do not reach `z` or a bearing: it
    cannot be modelled as flexible.
    """
    push = np.eye(6)[0]
    try:
        elastic = elastic_shaft(shaft, [(z, push), *((b.z, push) for b in bearings)], element=ELEMENT, frequency=0.0)
    except InputError:
        return 0.0

    def shapes_at(place: float) -> np.ndarray:
        return np.concatenate([[1.0, place], elastic.motion_at(place)[0]])

    stiffness = np.diag(np.concatenate([np.zeros(2), elastic.squared]))
    for bearing in bearings:
        stiffness += bearing.radial_stiffness * np.outer(shapes_at(bearing.z), shapes_at(bearing.z))
    rigid = shapes_at(z)[:2] @ np.linalg.solve(stiffness[:2, :2], shapes_at(z)[:2])
    return float(shapes_at(z) @ np.linalg.solve(stiffness, shapes_at(z)) / rigid - 1.0)


def torsional_mode(box: dynamics.Gearbox, laws: Any, housing: Any, knobs: DynamicsFidelity, torque: float) -> float:
    """Hz of the mode with the most twist of the rotors against each other per displacement of the mesh."""
    model = simulation(box, laws, housing, input_torque=torque, time_step=1e-5, fidelity=knobs)
    a = model.assembly
    stiffness = a.stiffness + (a.contact.T * model.contact_stiffness) @ a.contact
    root = np.sqrt(a.mass)
    squared, shapes = np.linalg.eigh(stiffness / np.outer(root, root))
    turned = np.abs(a.torques[0] @ (shapes / root[:, None])) * np.sqrt(a.inertia[0])
    return float(np.sqrt(squared[int(np.argmax(turned))]) / (2.0 * pi))


def harmonics(force: FloatArray, orders: list[int], turns: float) -> FloatArray:
    """dB of the lines of `orders` in a record (n, …) N over whole `turns` of the input."""
    lines = np.abs(np.fft.rfft(force.reshape(len(force), -1), axis=0)) * 2.0 / len(force)
    return np.array([10.0 * np.log10((lines[round(order * turns)] ** 2).sum()) for order in orders])


def main() -> None:
    case: Any = replace(nvh.load_case(ROOT / "cases" / "small" / "single_stage.toml"), quantities=("bearing_forces",))
    made = nvh.run(case, fidelity=nvh.DRAFT, out=Path(sys.argv[1]))
    box, speed = case.gearbox_with_gears, case.operation.input_speed
    at_gears = replace(
        box,
        shafts=tuple(replace(shaft, coupling_z=gear.z) for shaft, gear in zip(box.shafts, case.gears, strict=True)),
    )
    orders = [20 * k for k in range(1, 7)]
    knobs, found = nvh.DRAFT.dynamics, {}
    for name, gearbox in (
        ("rigid shafts", box),
        ("bending, rotors at the gears", replace(at_gears, flexible_shafts=True)),
        ("bending and twist", replace(box, flexible_shafts=True)),
    ):
        record = dynamics.bearing_forces(
            gearbox, made.mesh_laws, made.housing, input_speed=speed, input_torque=case.operation.input_torque,
            f_max=case.band.high, fidelity=replace(knobs, settle_level=1e-4),
        )  # fmt: skip
        turns = len(record.time) / record.sample_rate * speed / (2.0 * pi)
        torsion = torsional_mode(gearbox, made.mesh_laws, made.housing, knobs, case.operation.input_torque)
        found[name] = torsion, harmonics(record.force, orders, turns)
    usual = found["rigid shafts"][1]
    publish(
        "dynamics/shafts",
        "\n".join(
            [
                "# Flexible shafts of the small case",
                "",
                "Draft law and housing, 1800 rpm, 60 N m.",
                "",
                "Give at the gear under a radial force, and twist from rotor to gear along the line of action:",
                "",
                "| shaft | bearings / nm/N | bending, textbook | bending, elements | twist, textbook |",
                "|---|---:|---:|---:|---:|",
                *(
                    f"| {name} | " + " | ".join(f"{1e9 * value:.3f}" for value in values) + " |"
                    for name, *values in textbook(case)
                ),
                "",
                "Bearing forces, all bearings and directions, against rigid shafts:",
                "",
                "| shafts | torsional mode / Hz | " + " | ".join(f"order {order} / dB" for order in orders) + " |",
                "|---|---:|" + "---:|" * len(orders),
                *(
                    f"| {name} | {torsion:.0f} | " + " | ".join(f"{off:+.1f}" for off in level - usual) + " |"
                    for name, (torsion, level) in found.items()
                ),
                "",
                "The rotors hang on the free ends of shafts of 24 and 30 mm: stiff shafts tie them to the gears, real",
                "ones let them go. The forces of the elements are those of the exact differential equations within",
                "0.5 % (`tests/dynamics/test_geared_flexible_shafts.py`): what the sweep of this case shows for",
                "`options.flexible_shafts` is what its shafts do.",
                "",
            ]
        ),
    )


if __name__ == "__main__":
    main()
