"""Estimated time, memory and disk of a study: operators that its designs share count once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import lcm
from typing import Any

import numpy as np

from nvhchain import gear
from nvhchain.case import Case, GearboxCase, load_case
from nvhchain.error_band.run_up import LINES
from nvhchain.errors import InputError
from nvhchain.fidelity import Fidelity, GearFidelity
from nvhchain.files.result_cache import fingerprint
from nvhchain.scene import plan
from nvhchain.scene.mechanics import law_knobs
from nvhchain.study.definition import DRAWN, PAIRED, Study
from nvhchain.study.measuring import can_be_drawn
from nvhchain.study.parameter import Parameter
from nvhchain.study.plans.designs import STEPS, count_designs, list_designs
from nvhchain.study.rows import Row, operating_points

MOST_LOADED = 200
"""Largest number of runs whose cases are compared; more are scaled up from so many."""

MEMORY = (40_000, 330)
"""Memory (bytes) of a run in this process: its case and row, and every line of its limits.

Measured on the drawn single stage: 24 kB for the case; 45 kB for 130 lines, 128 kB for the 390 of a run-up.
"""

DISK = (1_000, 130)
"""Disk (bytes) of a row, and of every line of its limits. Measured: 17 kB for 130 lines, 49 kB for 390."""

BODY_BYTES = 3_000.0
"""Disk of the blank of a gear, over the teeth of a sector and the square of its layers of elements.

Measured at `draft` and `standard`: 0.7 to 2.9 kB for solid bodies, 1.7 to 3.4 kB for bodies with slots or windows.
"""

PRESSURE_SECONDS, PRESSURE_ROW_SECONDS, DEVIATED_ANGLES = 1.8e-3, 2.6e-4, 4
"""Seconds of the contact problem at an angle, and of an angle of all turns of a gearbox with deviations, whose largest
pressure takes so many times the angles of a mesh period.  Measured: 0.12 s as drawn and 1.4 s over 60 meshes of the
single stage, 21 s over 1230 meshes of a second stage.
"""

PRESSURE_MEGABYTES = (350.0, 2e-3)
"""Memory of a run, and of each of its angles (MB)."""


@dataclass(frozen=True)
class Cost:
    """Estimated cost of one step over a study.

    name: step in words.
    times: number of different results of the step.
    seconds: processor time of each (s).
    megabytes: peak memory of each (MB).
    disk: size of the files of all results (MB), right within a factor of three; 0 where they are not kept.
    """

    name: str
    times: int
    seconds: float
    megabytes: float
    disk: float = 0.0


def costs(study: Study, fidelity: Fidelity, most: int = MOST_LOADED) -> list[Cost]:
    """Return the estimated cost of every step of a study.

    most: largest number of runs whose cases are compared; more are scaled up from so many.
    Returns steps in the order of a run. Each design counts with the seconds of the base case.

    Searches and slopes choose their designs by results: a step counts for all designs if any parameter changes it.
    Parts of a mesh law that designs share, such as finite elements of a gear, are not subtracted.
    """
    case = load_case(study.case)
    fixed = study.scatter if can_be_drawn(case, fidelity) else ()  # drawn gearboxes share what their mean case has
    different = _counter(study, most, ())
    shared = _counter(study, most, fixed) if fixed else different
    steps = plan(case, fidelity=fidelity).steps
    counts = {name: number for step in steps for name, number in step.counts.items()}
    found = []
    for step in steps:
        counter = shared if step.name in ("housing", "transfer vectors") else different
        times = counter(partial(_key, name=step.name, knobs=fidelity.gear)) if step.step.shared else count_runs(study)
        disk = times * _file_bytes(case, step.name, counts, fidelity) + _body_bytes(
            case, step.name, different, fidelity
        )
        found.append(Cost(step.name, times, step.seconds, step.megabytes, 1e-6 * disk))
    if "contact_pressure" in study.responses and isinstance(case, GearboxCase):
        found += _contact_pressures(case, fidelity, different)
    return found


def _contact_pressures(
    case: GearboxCase, fidelity: Fidelity, different: Callable[[Callable[[Case], str]], int]
) -> Iterator[Cost]:
    """Yield the cost of the largest pressures of every stage, which all speeds of a gearbox share."""
    for stage, pair, deviations in zip(case.stages, case.pairs, case.deviations, strict=True):
        angles = fidelity.gear.angles_per_mesh
        rows = angles * (deviations.meshes(pair) if deviations is not None else 0)
        seconds, megabytes = PRESSURE_SECONDS * angles, PRESSURE_MEGABYTES[0] + PRESSURE_MEGABYTES[1] * rows
        if rows:
            seconds += PRESSURE_SECONDS * DEVIATED_ANGLES * angles + PRESSURE_ROW_SECONDS * rows
        times = different(partial(_key, name=f"deviated contact pressure {stage.name}", knobs=fidelity.gear))
        yield Cost(f"contact pressure {stage.name}", times, seconds, megabytes)


def count_runs(study: Study) -> int:
    """Return the number of runs of a study: designs times operating points."""
    return count_designs(study) * len(operating_points(study))


def further_runs(study: Study) -> int:
    """Return the largest number of runs beyond those of the plan, which find the parameters that change nothing."""
    return 2 * len(study.parameters) * len(operating_points(study)) if study.plan in DRAWN else 0


def run_bytes(study: Study, kind: tuple[int, int]) -> int:
    """Return the memory or the disk (bytes) that the rows of a study take.

    kind: `MEMORY` or `DISK`.
    """
    case = load_case(study.case)
    lines = 0.0
    if study.plan in PAIRED and "pressure" in case.quantities:
        lines = min(case.line_count, LINES) if case.running_up else case.line_count
    return count_runs(study) * round(kind[0] + kind[1] * lines)


def disk_bytes(study: Study, found: Sequence[Cost]) -> float:
    """Return the estimated disk (bytes) of the rows and operators of a study.

    found: costs of the study.
    """
    return run_bytes(study, DISK) + 1e6 * sum(cost.disk for cost in found)


def _body_bytes(case: Case, name: str, different: Callable[[Callable[[Case], str]], int], fidelity: Fidelity) -> float:
    """Return the disk of the finite elements of the gears of a mesh law; 0 for other steps."""
    total = 0.0
    for number, stage in enumerate(case.stages if isinstance(case, GearboxCase) else ()):
        if name == f"mesh law {stage.name}":
            for place in ("pinion", "wheel"):
                body = getattr(case.pairs[number], place)  # type: ignore[union-attr]
                knobs, layers = fidelity.gear, fidelity.gear.tooth_layers(body.geometry.relative_width)
                points = 2 * (2 * knobs.profile_elements + 1) * (2 * layers + 1)
                each = BODY_BYTES * body.sector * knobs.width_layers**2 + 8.0 * points**2
                total += each * different(partial(_body_key, stage=number, place=place))
    return total


def _body_key(case: Case, stage: int, place: str) -> str:
    """Return a fingerprint of the finite elements of a gear."""
    assert isinstance(case, GearboxCase)
    body: gear.GearBody = getattr(case.pairs[stage], place)
    return fingerprint(replace(body, geometry=replace(body.geometry, micro=gear.MicroGeometry())))


def _file_bytes(case: Case, name: str, counts: Mapping[str, float], fidelity: Fidelity) -> float:
    """Return the estimated size (bytes) of each result of a step, whose parts are among `counts`."""
    triangles, masters, modes = (counts.get(part, 0.0) for part in ("triangles", "masters", "modes"))
    if name == "transfer vectors":
        return 16.0 * masters * triangles * len(case.field_points)
    if not isinstance(case, GearboxCase):
        return 0.0
    if name == "housing":
        return 8.0 * triangles * (modes + 9 * len(case.bearings))
    for number, stage in enumerate(case.stages):
        pair = case.pairs[number]
        if name == f"mesh law {stage.name}":
            knobs = law_knobs(case, number, fidelity.gear)
            angles = lcm(pair.pinion.sector, pair.wheel.sector) * knobs.angles_per_mesh
            pairs = 50.0 * angles * gear.slice_count(pair, knobs) ** 2 if case.deviations[number] else 0.0
            return 14e3 + 8.0 * angles * knobs.deflections + pairs
    return 0.0


def _counter(study: Study, most: int, fixed: Sequence[Parameter]) -> Callable[[Callable[[Case], str]], int]:
    """Return the function that counts the different keys of all cases; `fixed` parameters stay as in the base case."""
    if study.plan in ("optimise", "gradient"):
        return partial(_searched, study, fixed)
    cases = list(_cases(study, most, fixed))
    scale = count_runs(study) / max(1, len(cases))

    def different(key: Callable[[Case], str]) -> int:
        keys = len({key(case) for case in cases})
        return keys if keys < len(cases) or scale <= 1 else round(scale * keys)

    return different


def _searched(study: Study, fixed: Sequence[Parameter], key: Callable[[Case], str]) -> int:
    """Return the largest number of different keys in a search, or in the steps of slopes."""
    points = [load_case(study.case, changes=point.changes) for point in operating_points(study)]
    first = key(points[0])

    def moves(parameter: Parameter) -> bool:
        for share in (0.2, 0.8):
            with suppress(InputError):
                changes = [*parameter.changes(parameter.value_at(share)), *operating_points(study)[0].changes]
                if key(load_case(study.case, changes=changes)) != first:
                    return True
        return False

    moving = sum(moves(parameter) for parameter in study.parameters if parameter not in fixed)
    times = len({key(case) for case in points})
    if study.goal is None:
        return times * (1 + 2 * STEPS * moving)
    drawn = study.goal.draws if not fixed and any(map(moves, study.goal.scatter)) else 1
    return times * drawn * (study.designs if moving else 1)


def _cases(study: Study, most: int, fixed: Sequence[Parameter]) -> Iterator[Case]:
    """Yield the cases of the runs, or of `most` of them spread over all; none of designs that fail."""
    varied = [parameter for parameter in study.varied if parameter not in fixed]
    runs = [
        Row(number, design, point.speed_rpm, point.torque)
        for number, design in enumerate(list_designs(study))
        for point in operating_points(study)
    ]
    for index in np.unique(np.linspace(0, len(runs) - 1, min(len(runs), most)).astype(int)):
        row = runs[index]
        changes = [each for parameter in varied for each in parameter.changes(row.values[parameter.name])]
        try:
            yield load_case(study.case, changes=[*changes, *row.point.changes])
        except InputError:
            continue


def _key(case: Case, name: str, knobs: GearFidelity) -> str:
    """Return a fingerprint of what a shared step depends on."""
    if not isinstance(case, GearboxCase):
        return fingerprint(case.body, case.frequencies, case.field_points, case.air, case.reflecting_plane)
    for number, stage in enumerate(case.stages):
        if name.endswith(f" {stage.name}"):
            deviations = case.deviations[number] if name.startswith("deviated") else None
            force = abs(case.mesh_forces[number])
            if not name.startswith("mesh law"):
                return fingerprint(case.pairs[number], force, deviations)
            return fingerprint(case.pairs[number], gear.law_load(force), law_knobs(case, number, knobs))
    seats: list[Any] = [(bearing.name, bearing.shaft, bearing.z) for bearing in case.bearings]
    axes = [(shaft.name, shaft.axis) for shaft in case.shafts]
    place = (case.field_points, case.air, case.reflecting_plane) if name != "housing" else ()
    return fingerprint(case.housing, case.band, seats, axes, case.seat_motions, *place)
