"""Runs of a study: every design at every speed and torque, with shared operators, in rows that outlast a kill."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from nvhchain.case import Case, load_case
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.folder_lock import hold_folder
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.files.result_cache import code_version, fingerprint
from nvhchain.kinds import checked
from nvhchain.runtime.cluster import worker_lost
from nvhchain.study.definition import Study
from nvhchain.study.designs import Design, list_designs
from nvhchain.study.measuring import can_be_drawn, measure, measure_drawn

_CODE = ("gear", "dynamics", "housing", "acoustics", "error_band", "spectrum", "scene", "chain", "study/measuring")
"""Packages and modules on which a row depends."""

OPERATORS = "operators"
"""Name of the folder of mesh laws, housings and transfer vectors that designs share."""


@dataclass(frozen=True)
class Row:
    """One design at one speed and torque.

    Parameters
    ----------
    design : int
        Number of the design, from 0.
    values : dict
        Parameter → value.
    speed_rpm, torque : float, optional
        Operating point, where the study sets it (rpm, N·m).
    responses : dict
        Response → number; empty for a refused design.
    limits : dict
        Response → confidence limits (lower, upper); None for a limit that does not exist.
    refused : str, optional
        Reason why there is no result.
    seconds : float
        Time of the run (s).
    """

    design: int
    values: Design
    speed_rpm: float | None = None
    torque: float | None = None
    responses: dict[str, float] = field(default_factory=dict)
    limits: dict[str, tuple[float | None, float | None]] = field(default_factory=dict)
    refused: str | None = None
    seconds: float = 0.0


@dataclass(frozen=True)
class Point:
    """Operating point.

    Parameters
    ----------
    speed_rpm, torque : float, optional
        Speed (rpm) and torque (N·m) on the input shaft; None for that of the case.
    """

    speed_rpm: float | None
    torque: float | None

    @property
    def changes(self) -> list[str]:
        """Assignments "path = value"."""
        places = {"operation.input_speed_rpm": self.speed_rpm, "operation.input_torque": self.torque}
        return [f"{path} = {value!r}" for path, value in places.items() if value is not None]


@checked
def run_study(
    study: Study,
    *,
    out: str | Path,
    fidelity: Fidelity = STANDARD,
    executor: Executor | None = None,
    progress: Callable[[str], None] | None = None,
) -> list[Row]:
    """Run every design of a study at every operating point; take rows of an earlier call where nothing has changed.

    Parameters
    ----------
    study : Study
        Study.
    out : str or Path
        Folder for rows and operators.
    fidelity : Fidelity
        Fidelity of all runs.
    executor : concurrent.futures.Executor, optional
        Executor of designs, such as a process pool; operators are computed first in this process.
    progress : callable, optional
        Receives a line for every run.

    Returns
    -------
    list of Row
        Rows in the order of designs and operating points. A failed design is a row with its reason.

    Raises
    ------
    InputError
        If the base case cannot be read, a parameter fits no place of it, or there are too many designs.

    Notes
    -----
    Equal designs are computed once. A lost worker costs one run, which is repeated in this process.
    """
    designs, points = list_designs(study), operating_points(study)
    check_parameters(study)
    folder = writable_folder(out, "out")
    with hold_folder(folder):
        return _rows(study, designs, points, folder, _Executed(fidelity, executor, progress))


def operating_points(study: Study) -> list[Point]:
    """Return the operating points of every design.

    Parameters
    ----------
    study : Study
        Study.

    Returns
    -------
    list of Point
        Every speed with every torque.
    """
    return [Point(*both) for both in product(study.speeds_rpm or (None,), study.torques or (None,))]


def check_parameters(study: Study) -> None:
    """Read the base case with every parameter at its values.

    Parameters
    ----------
    study : Study
        Study.

    Raises
    ------
    InputError
        If the base case cannot be read, a parameter fits no place of it, or all its values give the same case.
    """
    load_case(study.case)
    for parameter in study.parameters:
        ends = parameter.levels or (parameter.value_at(0.02), parameter.value_at(0.98))
        reasons, cases = [], []
        for value in ends:
            try:
                cases.append(load_case(study.case, changes=parameter.changes(value)))
            except InputError as error:
                reasons.append(str(error))
        misspelt = [reason for reason in reasons if "unknown field" in reason or " no '" in reason]
        if misspelt or not cases:
            raise InputError(f"{parameter.name}: does not fit {Path(study.case).name}: {(misspelt or reasons)[0]}")
        require(
            len(cases) < len(ends) or len(ends) < 2 or len({fingerprint(case) for case in cases}) > 1,
            f"{parameter.name}: all values give the same case: leave it out, or correct its path",
        )


@dataclass(frozen=True)
class _Executed:
    fidelity: Fidelity
    executor: Executor | None
    progress: Callable[[str], None] | None

    def report(self, line: str) -> None:
        if self.progress is not None:
            self.progress(line)


@dataclass(frozen=True)
class _Task:
    """Run of one case for the rows that share it."""

    key: str
    case: Case
    rows: tuple[int, ...]
    drawn: bool = False

    @property
    def measure(self) -> Callable[..., dict[str, Any]]:
        """Function that runs it."""
        return measure_drawn if self.drawn else measure


def _rows(study: Study, designs: Sequence[Design], points: Sequence[Point], folder: Path, how: _Executed) -> list[Row]:
    places = [(number, design, point) for number, design in enumerate(designs) for point in points]
    empty = [Row(number, design, point.speed_rpm, point.torque) for number, design, point in places]
    rows: list[Row | None] = [None] * len(places)
    tasks: dict[str, _Task] = {}
    draws = all(parameter.draws_deviations for parameter in study.parameters)
    for index, (_, design, point) in enumerate(places):
        changes = [
            change for parameter in study.parameters for change in parameter.changes(design[parameter.name])
        ] + point.changes
        try:
            case = load_case(study.case, changes=changes)
        except InputError as error:
            rows[index] = _refused(empty[index], error)
            continue
        key = fingerprint(case, how.fidelity, *map(code_version, _CODE))
        same = tasks.get(key)
        drawn = draws and can_be_drawn(case, how.fidelity)
        tasks[key] = _Task(key, case, (*(same.rows if same else ()), index), drawn)
    left = []
    for task in tasks.values():
        found = _kept(folder, task.key)
        if found is None:
            left.append(task)
        else:
            _fill(rows, empty, task, found)
    how.report(f"{len(places)} runs: {len(tasks)} different ones, {len(tasks) - len(left)} cached")
    began = time.monotonic()
    for done, (task, found) in enumerate(_measured(left, folder / OPERATORS, how), 1):
        write_text(_record(folder, task.key), json.dumps(found) + "\n")
        _fill(rows, empty, task, found)
        each = (time.monotonic() - began) / done
        how.report(f"{done} of {len(left)}: {_words(found)}; about {each * (len(left) - done):.0f} s left")
    return [row for row in rows if row is not None]


def _refused(row: Row, error: Exception) -> Row:
    return Row(row.design, row.values, row.speed_rpm, row.torque, refused=" ".join(str(error).split()))


def _fill(rows: list[Row | None], empty: Sequence[Row], task: _Task, found: dict[str, Any]) -> None:
    for index in task.rows:
        row = empty[index]
        limits = {name: (low, high) for name, (low, high) in found["limits"].items()}
        rows[index] = Row(
            row.design,
            row.values,
            row.speed_rpm,
            row.torque,
            found["responses"],
            limits,
            found["refused"],
            found["seconds"],
        )


def _words(found: dict[str, Any]) -> str:
    if found["refused"]:
        return f"refused ({found['refused']:.80})"
    shown = [f"{name} {value:.4g}" for name, value in found["responses"].items()]
    return ", ".join(shown[:3]) + f" ({found['seconds']:.1f} s)"


def _record(folder: Path, key: str) -> Path:
    return folder / "rows" / f"{key}.json"


def _kept(folder: Path, key: str) -> dict[str, Any] | None:
    """Return the outcome of an earlier run; None for none, a damaged one and a failed one."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        found: dict[str, Any] = json.loads(_record(folder, key).read_text(encoding="utf-8"))
        if found["refused"] is None and set(found) == {"responses", "limits", "refused", "seconds"}:
            return found
    return None


def _measured(tasks: Sequence[_Task], operators: Path, how: _Executed) -> Iterator[tuple[_Task, dict[str, Any]]]:
    """Yield every task with its outcome, in the order of their ends; the first one alone, for the shared operators."""
    if not tasks:
        return
    writable_folder(operators, "operators")
    writable_folder(operators.parent / "rows", "rows")
    alone = len(tasks) if how.executor is None else 1
    for task in tasks[:alone]:
        yield task, task.measure(task.case, how.fidelity, operators)
    if how.executor is None:
        return
    waiting: dict[Future[dict[str, Any]], _Task] = {
        how.executor.submit(task.measure, task.case, how.fidelity, operators): task for task in tasks[1:]
    }
    try:
        for future in as_completed(waiting):
            task, error = waiting[future], future.exception()
            if error is not None and not worker_lost(error):
                raise error
            again = error is not None
            yield task, task.measure(task.case, how.fidelity, operators) if again else future.result()
    finally:
        for future in waiting:
            future.cancel()
