"""Estimated time and memory of a study: operators that its designs share count once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from nvhchain.case import Case, GearboxCase, load_case
from nvhchain.errors import InputError
from nvhchain.fidelity import Fidelity
from nvhchain.files.result_cache import fingerprint
from nvhchain.scene import plan
from nvhchain.study.definition import Study
from nvhchain.study.parameter import Parameter
from nvhchain.study.plans.designs import STEPS, count_designs, list_designs
from nvhchain.study.rows import Row, operating_points

MOST_LOADED = 200
"""Largest number of runs whose cases are compared; more are scaled up from so many."""


@dataclass(frozen=True)
class Cost:
    """Estimated cost of one step over a study.

    Parameters
    ----------
    name : str
        Step in words.
    times : int
        Number of different results of the step.
    seconds : float
        Processor time of each (s).
    megabytes : float
        Peak memory of each (MB).
    """

    name: str
    times: int
    seconds: float
    megabytes: float


def costs(study: Study, fidelity: Fidelity) -> list[Cost]:
    """Return the estimated cost of every step of a study.

    Returns steps in the order of a run. Each design counts with the seconds of the base case.

    Searches and slopes choose their designs by results: a step counts for all designs if any parameter changes it.
    Parts of a mesh law that designs share, such as finite elements of a gear, are not subtracted.
    """
    count = count_designs(study) * len(operating_points(study))
    chosen = study.plan not in ("optimise", "gradient")
    cases = list(_cases(study)) if chosen else []
    scale = count / max(1, len(cases))
    found = []
    for step in plan(load_case(study.case), fidelity=fidelity).steps:
        if not step.step.shared:
            times = count
        elif not chosen:
            times = _searched(study, step.name)
        else:
            different = len({_key(case, step.name) for case in cases})
            times = different if different < len(cases) or scale <= 1 else round(scale * different)
        found.append(Cost(step.name, times, step.seconds, step.megabytes))
    return found


def _searched(study: Study, name: str) -> int:
    """Return the largest number of different results of a shared step in a search, or in the steps of slopes."""
    points = [load_case(study.case, changes=point.changes) for point in operating_points(study)]
    first = _key(points[0], name)

    def moves(parameter: Parameter) -> bool:
        for share in (0.2, 0.8):
            with suppress(InputError):
                changes = [*parameter.changes(parameter.value_at(share)), *operating_points(study)[0].changes]
                if _key(load_case(study.case, changes=changes), name) != first:
                    return True
        return False

    moving = sum(map(moves, study.parameters))
    times = len({_key(case, name) for case in points})
    if study.goal is None:
        return times * (1 + 2 * STEPS * moving)
    drawn = study.goal.draws if any(map(moves, study.goal.scatter)) else 1
    return times * drawn * (study.designs if moving else 1)


def _cases(study: Study) -> Iterator[Case]:
    """Yield the cases of the runs, or of some of them spread over all; none of designs that fail."""
    runs = [
        Row(number, design, point.speed_rpm, point.torque)
        for number, design in enumerate(list_designs(study))
        for point in operating_points(study)
    ]
    for index in np.unique(np.linspace(0, len(runs) - 1, min(len(runs), MOST_LOADED)).astype(int)):
        row = runs[index]
        changes = [each for parameter in study.varied for each in parameter.changes(row.values[parameter.name])]
        try:
            yield load_case(study.case, changes=[*changes, *row.point.changes])
        except InputError:
            continue


def _key(case: Case, name: str) -> str:
    """Return a fingerprint of what a shared step depends on."""
    if not isinstance(case, GearboxCase):
        return fingerprint(case.body, case.frequencies, case.field_points, case.air, case.reflecting_plane)
    for number, stage in enumerate(case.stages):
        if name.endswith(f" {stage.name}"):
            deviations = case.deviations[number] if name.startswith("deviated") else None
            return fingerprint(case.pairs[number], abs(case.mesh_forces[number]), deviations)
    seats: list[Any] = [(bearing.name, bearing.shaft, bearing.z) for bearing in case.bearings]
    axes = [(shaft.name, shaft.axis) for shaft in case.shafts]
    place = (case.field_points, case.air, case.reflecting_plane) if name != "housing" else ()
    return fingerprint(case.housing, case.band, seats, axes, case.seat_motions, *place)
