"""Mesh laws of gears with deviations against the contact problem, at standstill and in the time loop.

    python -m benchmarks deviations

Prints errors of transmission errors and of sidebands, for the single stage.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import nvhchain as nvh
from nvhchain import dynamics, gear
from nvhchain.case import Deviations, GearboxCase
from nvhchain.fidelity import GearFidelity
from nvhchain.handoff import FloatArray, MeshLaw

CASE = Path(__file__).parents[2] / "cases/small/single_stage.toml"
EVERY = 8
"""Angles of the law from one contact problem at standstill to the next."""
ANALYTIC = replace(nvh.DRAFT.gear, slices=8, bodies="analytic")
"""Gears in the time loop, whose contact problem is solved at every step."""
LOOP = replace(nvh.DRAFT.dynamics, time_step=40e-6, settle_level=1e-3, contact_residual=1e-6)


def deviated(case: GearboxCase, fidelity: GearFidelity) -> tuple[MeshLaw, gear.Engagement]:
    """Return the mesh law of a stage with deviations, and its contact problem."""
    (pair,), (force,), (deviations,) = case.pairs, case.mesh_forces, case.deviations
    assert deviations is not None
    compliances = gear.pair_compliances(pair, fidelity)
    law = gear.mesh_law(pair, nominal_force=force, fidelity=fidelity, compliances=compliances)
    springs = gear.tooth_pairs(pair, law, nominal_force=force, fidelity=fidelity, compliances=compliances)
    contact = gear.Engagement(pair, compliances, fidelity, deviations)
    return gear.deviated_mesh_law(pair, law, springs, deviations), contact


def drawn(grade: int, *, wheel: bool) -> GearboxCase:
    """Return the single stage with gears of a class."""
    case = nvh.load_case(CASE)
    assert isinstance(case, GearboxCase)
    gears = [replace(one, deviations=Deviations(grade, seed=1 + i)) for i, one in enumerate(case.gears)]
    return replace(case, gears=(gears[0], gears[1] if wheel else case.gears[1]))


def compare(title: str, found: FloatArray, exact: FloatArray, mesh: int) -> None:
    """Print the errors over the swing, and of the lines within 30 dB of the mesh order."""
    error, swing = found - exact, np.ptp(exact)
    print(f"{title}: swing {1e6 * swing:.1f} µm, error {100 * np.abs(error).max() / swing:.1f} % at most, ", end="")
    print(f"{100 * error.std() / swing:.1f} % in the mean square")
    mine, theirs = (np.abs(np.fft.rfft(values)) for values in (found, exact))
    near = [k for k in range(mesh // 2, 3 * mesh // 2) if theirs[k] > theirs[mesh] * 10 ** (-30 / 20)]
    for k in sorted(near, key=lambda k: -theirs[k]):
        below, off = (20 * np.log10(one) for one in (theirs[k] / theirs[mesh], mine[k] / theirs[k]))
        print(f"  order {k - mesh:+d}: {below:6.1f} dB, error {off:+.2f} dB")


def main() -> None:
    """Print all comparisons."""
    for grade in (4, 6):
        case = drawn(grade, wheel=True)
        law, contact = deviated(case, nvh.DRAFT.gear)
        force, angles = case.mesh_forces[0], law.angle[::EVERY]
        guess, exact = 1e-5, []
        for angle in angles:
            guess = gear.loaded_mesh(contact, float(angle), force, guess=guess).deflection
            exact.append(guess)
        found = gear.deflection_at_force(law, force)[::EVERY]
        compare(f"class {grade}, both gears, all turns", found, np.array(exact), 60)
    for grade in (4, 6):
        case = drawn(grade, wheel=False)
        law, contact = deviated(case, ANALYTIC)
        stiff = tuple(replace(one, radial_damping=12e3, axial_damping=6e3) for one in case.bearings)
        box = replace(case.gearbox_with_gears, bearings=stiff)
        records = [
            dynamics.bearing_forces(
                box,
                [law],
                None,
                input_speed=case.operation.input_speed,
                input_torque=case.operation.input_torque,
                f_max=2500.0,
                fidelity=replace(LOOP, mesh_level=level),
                contact_forces=[contact.mesh_force],
            )
            for level in ("table", "contact")
        ]
        found, exact_loop = (
            record.transmission_error[:, 0] for record in records if record.transmission_error is not None
        )
        compare(f"class {grade}, pinion, in the time loop", found, exact_loop, 20)


if __name__ == "__main__":
    main()
