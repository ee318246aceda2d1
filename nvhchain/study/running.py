"""Runs of a study: every design at every speed and torque, with shared operators, in rows that outlast a kill."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any

from nvhchain.case import Case, GearboxCase, load_case
from nvhchain.chain.running import OPERATORS
from nvhchain.errors import InputError, ResourceError, SolverError, check_all, require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.files.result_cache import Watcher, code_version, fingerprint
from nvhchain.kinds import checked
from nvhchain.report.case_record import case_values
from nvhchain.runtime.folder_lock import hold_folder
from nvhchain.runtime.memory import free_memory
from nvhchain.scene.modelling import modelled
from nvhchain.study.analysis import main_effects, responses_of, same_responses
from nvhchain.study.definition import DRAWN, PAIRED, Study
from nvhchain.study.measuring import can_be_drawn
from nvhchain.study.orders import brief_orders
from nvhchain.study.parameter import Design, Parameter
from nvhchain.study.plans.costs import DISK, MEMORY, Cost, costs, count_runs, run_bytes
from nvhchain.study.plans.designs import base_design, list_designs
from nvhchain.study.plans.gradient import walk_gradient
from nvhchain.study.plans.optimise import draws_of, search
from nvhchain.study.responses import check_requested, check_response, response_names
from nvhchain.study.rows import Row, operating_points
from nvhchain.study.spreading import Spread, Task

_CODE = ("gear", "dynamics", "housing", "acoustics", "error_band", "spectrum", "levels", "sound", "scene", "chain")
_OWN_CODE = ("study/measuring", "study/orders", "study/responses")
"""Packages and modules on which a row depends."""

_COMPARED = 20
"""Largest number of runs whose cases are compared for the disk that they need."""

CLEAR = 20.0
"""Share of the variance, times the number of designs, of a clear effect; chance alone gives about 3."""

_MISSPELT = ("unknown field", " no '", "must be of type", "must be a finite number")
"""Signs of a path or a value that no design can have; other designs that fail are rows with their reason."""


@checked
def run_study(
    study: Study,
    *,
    out: str | Path,
    operators: str | Path | None = None,
    fidelity: Fidelity = STANDARD,
    executor: Executor | None = None,
    progress: Callable[[str], None] | None = None,
    watcher: Watcher | None = None,
) -> list[Row]:
    """Run every design of a study at every operating point; take rows of an earlier call where nothing has changed.

    Parameters
    ----------
    study : Study
        Study.
    out : str or Path
        Folder for rows.
    operators : str or Path, optional
        Folder of mesh laws, housings and transfer vectors, such as that of another study; `operators` in `out` by
        default.
    fidelity : Fidelity
        Fidelity of all runs.
    executor : concurrent.futures.Executor, optional
        Executor of designs, such as a process pool or a dask cluster; the first run is done in this process.
    progress : callable, optional
        Receives a line for every run.
    watcher : Watcher, optional
        Receives begin, progress and end of the steps of the first run, which computes the shared operators.

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
    Equal designs are computed once. A lost worker costs one run, which is repeated. Memory limits the number of runs at
    once. Runs in processes share the cores of their machine evenly.
    """
    check_parameters(study)
    folder = writable_folder(out, "out")
    check_disk(study, folder, costs(study, fidelity, most=_COMPARED), operators)
    with hold_folder(folder):
        spread = Spread(fidelity, executor, Path(operators or folder / OPERATORS), study.responses)
        runs = _Runs(study, folder, spread, progress, watcher)
        found = remarks(study, fidelity)
        for line in found:
            runs.report(line)
        if study.plan == "optimise":
            rows = search(study, base_design(study), runs.rows)
        elif study.plan == "gradient":
            rows = walk_gradient(study, runs.rows)
        else:
            rows = runs.rows(list(enumerate(list_designs(study))))
        if study.plan in DRAWN:
            rows = _add_idle(runs, rows)
    return [replace(row, remarks=tuple(found) if index == 0 else ()) for index, row in enumerate(rows)]


def _add_idle(runs: _Runs, rows: list[Row]) -> list[Row]:
    """Return the rows of draws; the first one names the parameters that leave all responses alone.

    Every parameter changes in all draws, so that means over groups differ by chance. A parameter without a clear share
    of any variance gets the value of another design in two designs: the first, and the one that differs from it in most
    values. Variants then meet both. All other parameters keep theirs.
    """
    done = [row for row in rows if row.refused is None]
    count = len({row.design for row in done})
    if count < 2:
        return rows
    clear = {effect.parameter for effect in main_effects(runs.study, rows) if effect.share > CLEAR / count}
    idle = [parameter.name for parameter in runs.study.parameters if parameter.name not in clear]
    values = done[0].values
    other = max(reversed(done), key=lambda row: sum(row.values[name] != values[name] for name in values))
    for own, others in ((done[0], done[::-1]), (other, done)):
        tried = {
            name: value
            for name in idle
            for value in [row.values[name] for row in others if row.values[name] != own.values[name]][:1]
        }
        if not tried:
            break
        runs.report(f"Runs with one other value: {', '.join(tried)}")
        designs = [own.values | {name: value} for name, value in tried.items()]
        first = max(row.design for row in rows) + 1
        again = {(row.design - first, row.point): row for row in runs.rows(list(enumerate(designs, first)))}
        before = [row for row in rows if row.design == own.design]
        idle = [
            name
            for place, name in enumerate(tried)
            if all(same_responses(row, again.get((place, row.point))) for row in before)
        ]
    else:
        rows[rows.index(done[0])] = replace(done[0], idle=tuple(idle))
    return rows


def check_parameters(study: Study) -> None:
    """Read the base case with every parameter at its values; refuse more runs than the memory holds.

    Targets, figures and goals must name a response that a run may have.
    """
    _check_memory(study)
    known: dict[str, None] = {}
    for place in [place for place in ("speeds_rpm", "torques") if getattr(study, place)]:
        require(
            isinstance(load_case(study.case), GearboxCase),
            f"{place}: {Path(study.case).name} is no gearbox and has neither speed nor torque: leave {place} out",
        )
    for point in operating_points(study):
        base = load_case(study.case, changes=point.changes)
        check_requested(study.responses, base)
        known |= dict.fromkeys(response_names(base, study.responses))
    check_all(
        *(partial(_check_parameter, study, parameter, base, known) for parameter in study.varied),
        *(partial(check_response, name, place, known) for place, name in _named(study)),
    )


def remarks(study: Study, fidelity: Fidelity) -> list[str]:
    """Return lines on what the base case assumes, on responses that its runs lack, and on options it leaves out."""
    cases = [load_case(study.case, changes=point.changes) for point in operating_points(study)]
    gearboxes = [case for case in cases if isinstance(case, GearboxCase)]
    lines = [f"{case.name}: {text.rstrip('.')}" for case in gearboxes[:1] for text in case.assumptions]
    lines += [brief_orders(case) for case in gearboxes] if "orders" in study.responses else []
    with suppress(InputError, SolverError):  # a run states its reason
        for case in gearboxes[:1]:
            made = modelled(case, fidelity)
            lines += [f"{case.name}: {each.line(made.tolerance_db)}" for each in made.disputed]
    return [line for line in dict.fromkeys(lines) if line]


def _named(study: Study) -> list[tuple[str, str]]:
    """Return the fields of a study that name responses, with each response."""
    goal = [("optimise", study.goal.response)] if study.goal is not None else []
    return [*(("pareto", name) for name in study.pareto), *(("targets", name) for name in study.targets), *goal]


def check_disk(study: Study, folder: Path, found: Sequence[Cost], operators: str | Path | None = None) -> float:
    """Return the free disk (bytes) of a folder; refuse a study whose rows and operators need more.

    folder: folder of the study, which need not exist. Files in it count as its own.
    found: costs of the study.
    operators: folder of the operators, which may be on another disk; `operators` in `folder` by default.
    """
    parts = (
        (folder / "rows", float(run_bytes(study, DISK)), folder, "--out"),
        (folder / OPERATORS, 1e6 * sum(cost.disk for cost in found), folder, "--out"),
    )
    if operators is not None:
        parts = (parts[0], (Path(operators), parts[1][1], Path(operators), "--operators"))
    needed: dict[int, float] = {}
    for part, size, named, option in parts:
        disk, free = _disk(part)
        held = sum(file.stat().st_size for file in part.glob("*"))
        needed[disk] = needed.get(disk, 0.0) + max(size - held, 0.0)
        if needed[disk] > free:
            raise ResourceError(
                f"{count_runs(study)} runs need about {needed[disk] / 2**30:.3g} GiB of disk, {named} has "
                f"{free / 2**30:.3g} GiB: take fewer designs, or another {option}"
            )
    return _disk(folder)[1]


def _disk(folder: Path) -> tuple[int, float]:
    """Return number and free space (bytes) of the disk of a folder that need not exist."""
    place = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    return place.stat().st_dev, float(shutil.disk_usage(place).free)


def _check_memory(study: Study) -> None:
    needed, free = run_bytes(study, MEMORY), free_memory()
    if needed > 0.8 * free:
        raise ResourceError(
            f"{count_runs(study)} runs need about {needed / 2**30:.3g} GiB for their cases and rows, "
            f"{free / 2**30:.3g} GiB are free: take fewer designs, or several studies with other seeds"
        )


def _check_parameter(study: Study, parameter: Parameter, base: Case, known: dict[str, None]) -> None:
    """Refuse a parameter that fits no place of the case, or that changes nothing; add names of responses to `known`."""
    ends = parameter.levels or (parameter.value_at(0.02), parameter.value_at(0.98))
    reasons, cases = [], []
    for value in ends:
        try:
            cases.append(load_case(study.case, changes=parameter.changes(value)))
            known |= dict.fromkeys(response_names(cases[-1], study.responses))
        except InputError as error:
            reasons.append(str(error))
    misspelt = [reason for reason in reasons if any(sign in reason for sign in _MISSPELT)]
    if misspelt or not cases:
        reason = (misspelt or reasons)[0]
        near = (
            _nearest_path(study, parameter, base) if "unknown field" in reason and "did you mean" not in reason else ""
        )
        raise InputError(f"{parameter.name}: does not fit {Path(study.case).name}: {reason}{near}")
    require(
        len(cases) < len(ends)
        or len(ends) < 2
        or len({fingerprint(replace(case, name=base.name)) for case in cases}) > 1,
        f"{parameter.name}: all values give the same case: leave it out, or correct its path",
    )


def _nearest_path(study: Study, parameter: Parameter, base: Case) -> str:
    """Return the paths that are nearest to those of a parameter, in words; a list without names stands as a whole."""
    known = dict(case_values(base))
    close = []
    for path in parameter.given_paths:
        for near in get_close_matches(path, known, 1):
            change = Parameter(parameter.name, (near,), (known[near],)).changes(known[near])
            try:
                load_case(study.case, changes=change)
                close.append(near)
            except InputError:
                close.append(re.sub(r"\.\d+\..*", " (a list without names: give all of it)", near))
    return f"; nearest path: {', '.join(close)}" if close else ""


@dataclass(frozen=True)
class _Runs:
    """Folder and means of the runs of a study."""

    study: Study
    folder: Path
    spread: Spread
    progress: Callable[[str], None] | None
    watcher: Watcher | None
    cases: dict[tuple[str, ...], Case] = field(default_factory=dict)

    def report(self, line: str) -> None:
        if self.progress is not None:
            self.progress(line)

    def rows(self, designs: Sequence[tuple[int, Design]]) -> list[Row]:
        """Return the rows of numbered designs at every operating point, and with every draw of the tolerances."""
        draws = draws_of(self.study)
        points = operating_points(self.study)
        empty = [
            Row(number, design | draw, point.speed_rpm, point.torque, draw=place)
            for number, design in designs
            for place, draw in enumerate(draws)
            for point in points
        ]
        rows: list[Row | None] = [None] * len(empty)
        tasks: dict[str, Task] = {}
        code = [*map(code_version, (*_CODE, *_OWN_CODE))]
        for index, row in enumerate(empty):
            try:
                self._add(tasks, index, row, code)
            except InputError as error:
                rows[index] = _filled(row, {"refused": " ".join(str(error).split())})
        left = []
        for task in tasks.values():
            found = _kept(self.folder, task.key)
            if found is None:
                left.append(task)
            else:
                for index in task.rows:
                    rows[index] = _filled(empty[index], found)
        starts = range(0, len(rows), len(points))
        unchecked = designs[0][0] == 0 and not any(
            self._check_names(rows[start : start + len(points)]) for start in starts
        )
        several = f" of designs {designs[0][0]} to {designs[-1][0]}" if self.study.goal is not None else ""
        self.report(f"{len(empty)} runs{several}: {len(tasks)} different ones, {len(tasks) - len(left)} cached")
        if left:
            writable_folder(self.folder / "rows", "rows")
        watcher = self.watcher if designs[0][0] == 0 else None  # later ones find the operators
        for task, found, progress in self.spread.outcomes(left, watcher):
            if self.study.plan not in PAIRED:
                found["band"] = None  # large, and of use for differences alone
            write_text(_record(self.folder, task.key), json.dumps(found) + "\n")
            for index in task.rows:
                rows[index] = _filled(empty[index], found)
                start = index - index % len(points)
                unchecked = unchecked and not self._check_names(rows[start : start + len(points)])
            self.report(progress)
        done = [row for row in rows if row is not None]
        if unchecked:
            self._check_names([row for row in done if row.refused is None])
        return done

    def _check_names(self, rows: Sequence[Row | None]) -> bool:
        """Refuse figures, targets and a goal without a response in any of the rows; return False where one has failed.

        Operating points differ in responses: a transmission error needs a load, an order lies inside the band or not.
        """
        done = [row for row in rows if row is not None and row.refused is None]
        if not done or len(done) < len(rows):
            return False
        known = responses_of(done)
        for place, name in _named(self.study):
            check_response(name, place, known)
        return True

    def _add(self, tasks: dict[str, Task], index: int, row: Row, code: Sequence[str]) -> None:
        """Add the run of a row, or the row to the run of the same case."""
        varied, scatter = self.study.varied, self.study.scatter
        case = self._case(row, varied)
        mean = None  # limits of a drawn row are those of its mean case
        if scatter and can_be_drawn(case, self.spread.fidelity):
            mean = self._case(row, tuple(parameter for parameter in varied if parameter not in scatter))
        key = fingerprint(case, mean, self.spread.fidelity, self.study.responses, self.study.plan in PAIRED, *code)
        same, gearbox = tasks.get(key), -1 if mean is None else index // len(operating_points(self.study))
        tasks[key] = Task(key, case, (*(same.rows if same else ()), index), mean, same.gearbox if same else gearbox)

    def _case(self, row: Row, parameters: Sequence[Parameter]) -> Case:
        """Return the base case at the operating point and with the values of some parameters of a row."""
        changes = [change for parameter in parameters for change in parameter.changes(row.values[parameter.name])]
        changes += row.point.changes
        given = tuple(changes)
        if given not in self.cases:
            self.cases[given] = load_case(self.study.case, changes=given)
        return self.cases[given]


def _filled(row: Row, found: dict[str, Any]) -> Row:
    """Return a row with the outcome of its run."""
    limits = {name: (low, high) for name, (low, high) in found.get("limits", {}).items()}
    return replace(
        row,
        responses=found.get("responses", {}),
        limits=limits,
        refused=found["refused"],
        seconds=found.get("seconds", 0.0),
        band=found.get("band"),
    )


def _record(folder: Path, key: str) -> Path:
    return folder / "rows" / f"{key}.json"


def _kept(folder: Path, key: str) -> dict[str, Any] | None:
    """Return the outcome of an earlier run; None for none, a damaged one and a failed one."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        found: dict[str, Any] = json.loads(_record(folder, key).read_text(encoding="utf-8"))
        if found["refused"] is None and set(found) == {"responses", "limits", "band", "refused", "seconds"}:
            return found
    return None
