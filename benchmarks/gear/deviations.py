"""Laws of gears with deviations against the contact problem, at standstill and in every step of the time loop.

    python -m benchmarks deviations             docs/measured/gear/deviations.md
    python -m benchmarks deviations KIND ...    these kinds in the time loop, printed
    python -m benchmarks deviations levels      docs/measured/gear/deviation_levels.md

Single stage, 60 N·m, 1800 rpm. A kind of deviation is drawn at the limit of its class for the pinion; all teeth have
their own pitch, slopes and topography. Both results are transmission errors, over all turns of the gears.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain import dynamics, gear
from nvhchain.case import Deviations, GearboxCase
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity, GearFidelity
from nvhchain.gear.deviations.drawn import drawn_deviations
from nvhchain.gear.deviations.flanks import GearDeviations
from nvhchain.gear.deviations.pairs import PairDeviations
from nvhchain.gear.deviations.tolerances import FlankTolerances, flank_tolerances
from nvhchain.handoff import FloatArray, MeshLaw

CASE = Path(__file__).parents[2] / "cases/small/single_stage.toml"
EVERY = 2
"""Angles of the law from one contact problem at standstill to the next; 8 move single sidebands by 0.3 dB."""
CLASSES, CLASS_DRAWS = (3, 4, 5, 6, 7), 12
"""Classes and draws of each whose levels are published."""
DRAWS = 10
"""Other draws of class 6, with every 4th angle."""
ANALYTIC = replace(nvh.DRAFT.gear, slices=8, bodies="analytic")
"""Gears in the time loop, whose contact problem is solved at every step."""
LOOP = replace(nvh.DRAFT.dynamics, time_step=80e-6, settle_level=1e-2, contact_residual=1e-6)
REACH = 30.0
"""dB below the mesh order down to which sidebands are compared."""
NONE = FlankTolerances(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
KINDS = {
    "pitch": ("single_pitch", "cumulative_pitch"),
    "run-out": ("run_out", "cumulative_pitch"),
    "profile slope": ("profile_slope",),
    "profile form": ("profile_form",),
    "helix slope": ("helix_slope",),
    "helix form": ("helix_form",),
    "topography": (),
    "all of a class": tuple(vars(NONE)),
}
"""Kind of deviation → tolerances that it fills."""


def kind_deviations(geometry: gear.GearGeometry, kind: str, grade: int) -> GearDeviations:
    """Return deviations of one kind at the limits of a class, other teeth each with their own."""
    limits = flank_tolerances(geometry, grade)
    drawn = drawn_deviations(geometry, replace(NONE, **{name: getattr(limits, name) for name in KINDS[kind]}), seed=1)
    if kind == "pitch":
        return replace(drawn, eccentricity=0.0)
    if kind != "topography":
        return drawn
    # a bump of f_fα on a grid of every tooth, at a place and with a size of its own
    random = np.random.default_rng(1)
    profile, face = np.linspace(0.0, 1.0, 9)[:, None], np.linspace(0.0, 1.0, 7)
    grid = [
        limits.profile_form
        * random.uniform(0.3, 1.0)
        * np.exp(-(((profile - random.uniform()) / 0.3) ** 2) - ((face - random.uniform()) / 0.4) ** 2)
        for _ in range(geometry.teeth)
    ]
    return replace(drawn, drive=replace(drawn.drive, topography=np.array(grid)))


def deviated(case: GearboxCase, fidelity: GearFidelity, deviations: PairDeviations) -> tuple[MeshLaw, gear.Engagement]:
    """Return the mesh law of a stage with deviations, and its contact problem."""
    (pair,), (force,) = case.pairs, case.mesh_forces
    compliances = gear.pair_compliances(pair, fidelity)
    law = gear.mesh_law(pair, nominal_force=force, fidelity=fidelity, compliances=compliances)
    springs = gear.tooth_pairs(pair, law, nominal_force=force, fidelity=fidelity, compliances=compliances)
    contact = gear.Engagement(pair, compliances, fidelity, deviations)
    return gear.deviated_mesh_law(pair, law, springs, deviations), contact


def drawn_stage(grade: int, seed: int = 1) -> GearboxCase:
    """Return the single stage with both gears of a class."""
    case = nvh.load_case(CASE)
    assert isinstance(case, GearboxCase)
    gears = [replace(one, deviations=Deviations(grade, seed=seed + i)) for i, one in enumerate(case.gears)]
    return replace(case, gears=(gears[0], gears[1]))


@dataclass(frozen=True)
class Errors:
    """Errors of a transmission error against the exact one.

    swing : swing of the exact one (m).
    largest, mean_square : errors over the swing.
    mesh_order : error (dB) of the mesh order.
    sidebands : (level over the mesh order, error) (dB) of every line within reach of it.
    """

    swing: float
    largest: float
    mean_square: float
    mesh_order: float
    sidebands: tuple[tuple[float, float], ...]

    @property
    def worst(self) -> tuple[float, float] | None:
        """Sideband with the largest error."""
        return max(self.sidebands, key=lambda one: abs(one[1]), default=None)

    def row(self, title: str) -> str:
        """Return the row of a table."""
        side = "–" if self.worst is None else f"{self.worst[1]:+.2f}, {self.worst[0]:.0f}"
        return (
            f"| {title} | {1e6 * self.swing:.1f} | {100 * self.largest:.1f} | {100 * self.mean_square:.1f} "
            f"| {self.mesh_order:+.2f} | {len(self.sidebands)} | {side} |"
        )


def errors(found: FloatArray, exact: FloatArray, mesh: int) -> Errors:
    """Return the errors of a transmission error over `mesh` mesh periods."""
    error, swing = found - exact, float(np.ptp(exact))
    mine, theirs = (np.abs(np.fft.rfft(values)) for values in (found, exact))

    def off(k: int) -> float:
        return float(20 * np.log10(mine[k] / theirs[k]))

    heard = theirs[mesh] * 10 ** (-REACH / 20)
    near = [k for k in range(mesh // 2, 3 * mesh // 2) if theirs[k] > heard and k != mesh]
    sidebands = tuple((float(20 * np.log10(theirs[k] / theirs[mesh])), off(k)) for k in near)
    return Errors(swing, float(np.abs(error).max()) / swing, float(error.std()) / swing, off(mesh), sidebands)


def in_the_loop(case: GearboxCase, kind: str, grade: int, loop: DynamicsFidelity = LOOP) -> Errors:
    """Return the errors of the dynamic transmission error with a kind of deviation of the pinion."""
    (pair,) = case.pairs
    law, contact = deviated(case, ANALYTIC, PairDeviations(kind_deviations(pair.pinion.geometry, kind, grade), None))
    stiff = tuple(replace(one, radial_damping=12e3, axial_damping=6e3) for one in case.bearings)
    box = replace(case.gearbox_with_gears, bearings=stiff)
    found, exact = (
        dynamics.bearing_forces(
            box,
            [law],
            None,
            input_speed=case.operation.input_speed,
            input_torque=case.operation.input_torque,
            f_max=0.1 / loop.time_step,
            fidelity=replace(loop, mesh_level=level),
            contact_forces=[contact.mesh_force],
        ).transmission_error
        for level in ("table", "contact")
    )
    assert found is not None
    assert exact is not None
    return errors(found[:, 0], exact[:, 0], 20)


def at_standstill(grade: int, seed: int = 1, every: int = EVERY) -> Errors:
    """Return the errors of both gears of a class, with finite element bodies."""
    case = drawn_stage(grade, seed)
    (deviations,) = case.deviations
    assert deviations is not None
    law, contact = deviated(case, nvh.DRAFT.gear, deviations)
    force, guess, exact = case.mesh_forces[0], 1e-5, []
    for angle in law.angle[::every]:
        guess = gear.loaded_mesh(contact, float(angle), force, guess=guess).deflection
        exact.append(guess)
    return errors(gear.deflection_at_force(law, force)[::every], np.array(exact), 60)


def other_draws() -> str:
    """Return a line about other draws of class 6 at standstill."""
    drawn = [at_standstill(6, seed=10 * draw, every=4) for draw in range(1, DRAWS + 1)]
    off = np.abs([error for one in drawn for _, error in one.sidebands])
    largest, mean_square = max(one.largest for one in drawn), float(np.sqrt((off**2).mean()))
    return (
        f"{DRAWS} other draws of class 6: errors up to {100 * largest:.1f} % of the swing; {(off < 1).sum()} of "
        f"{len(off)} sidebands within 1 dB, their root mean square {mean_square:.2f} dB, the worst {off.max():.2f} dB."
    )


def table(rows: Iterator[str]) -> list[str]:
    """Return a table, printed row by row."""
    lines = [
        "| deviation | swing / µm | error / % of it | in the mean square | mesh order / dB | sidebands within "
        f"{REACH:.0f} dB | worst of them / dB, at |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        print(row, file=sys.stderr, flush=True)
        lines.append(row)
    return lines


def levels() -> None:
    """Publish transmission errors and levels of gears of every class."""
    rows = []
    with TemporaryDirectory() as operators:
        drawn = nvh.load_case(CASE)
        assert isinstance(drawn, GearboxCase)
        plain = nvh.run(drawn, fidelity=nvh.DRAFT, operators=operators)
        for grade in CLASSES:
            tolerance, found = flank_tolerances(drawn_stage(grade).gears[0].geometry, grade), []
            for draw in range(CLASS_DRAWS):
                case = drawn_stage(grade, seed=10 * draw + 1)
                try:
                    result = nvh.run(case, fidelity=nvh.DRAFT, operators=operators)
                except InputError as error:
                    print(f"class {grade}, draw {draw}: {error}", file=sys.stderr)
                    continue
                swing = np.ptp(gear.deflection_at_force(result.mesh_laws[0], case.mesh_forces[0]))
                found.append((1e6 * swing, result.overall[0]))
            swings, heard = np.percentile(found, (10, 50, 90), axis=0).T
            rows.append(
                f"| {grade} | {1e6 * tolerance.single_pitch:.2g} / {1e6 * tolerance.cumulative_pitch:.2g} | "
                f"{' … '.join(f'{value:.0f}' for value in swings)} | {' … '.join(f'{value:.1f}' for value in heard)} | "
                f"{len(found)} |"
            )
            print(rows[-1], file=sys.stderr, flush=True)
    swing = np.ptp(gear.deflection_at_force(plain.mesh_laws[0], drawn.mesh_forces[0]))
    publish(
        "gear/deviation_levels",
        f"Single stage at 1800 rpm and `draft`, both gears at the limits of their class, {CLASS_DRAWS} draws each. As "
        f"drawn it has {plain.overall[0]:.1f} dB(A) and a transmission error of {1e6 * swing:.1f} µm. Draws that are "
        "missing jammed: their backlash was spent, and the run was refused.\n\n"
        "| class | f_pT / F_pT of the pinion / µm | transmission error over all turns / µm, 10 … 50 … 90 % | "
        "level / dB(A), 10 … 50 … 90 % | draws |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n",
    )


def main() -> None:
    """Publish all comparisons, or print some."""
    case = nvh.load_case(CASE)
    assert isinstance(case, GearboxCase)
    if sys.argv[1:] == ["levels"]:
        levels()
        return
    if sys.argv[1:]:
        print("\n".join(table(in_the_loop(case, kind, 6).row(kind) for kind in sys.argv[1:])))
        return
    kinds = [(kind, 6) for kind in KINDS] + [("all of a class", 4)]
    loop = table(in_the_loop(case, kind, grade).row(f"{kind}, class {grade}") for kind, grade in kinds)
    still = table(at_standstill(grade).row(f"both gears, class {grade}") for grade in (4, 6))
    publish(
        "gear/deviations",
        "Contact problem in every step of the time loop against the law, deviations of the pinion, analytic bodies:\n\n"
        + "\n".join(loop)
        + "\n\nContact problem at standstill against the law, deviations of both gears, finite elements:\n\n"
        + "\n".join(still)
        + f"\n\n{other_draws()}\n",
    )


if __name__ == "__main__":
    main()
