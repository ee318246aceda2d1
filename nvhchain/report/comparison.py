"""Comparison of several configurations: one run each, shared operators, figures, sound and summary.json."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from nvhchain import chain, plots
from nvhchain.case import Case
from nvhchain.chain.result import Result
from nvhchain.chain.running import OPERATORS
from nvhchain.errors import InputError, collected_warnings, require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.files.result_cache import Watcher, origin
from nvhchain.handoff import HandOff
from nvhchain.kinds import checked
from nvhchain.names import check_names
from nvhchain.report.case_record import recorded_case
from nvhchain.report.page import write_page
from nvhchain.report.pictures.names import RUN_UP, STATES, STEADY, SURFACE
from nvhchain.report.recorded_modes import record_modes
from nvhchain.report.sound.microphones import add_balloons
from nvhchain.report.sound.write import write_sounds
from nvhchain.report.steady_states import TABLE, steady_maps
from nvhchain.report.summary import transmission_errors, write_summary
from nvhchain.report.unchanged import RECORD, earlier_summary, fingerprint_of, keep_record
from nvhchain.runtime.folder_lock import hold_folder
from nvhchain.runtime.threads import one_blas_thread
from nvhchain.scene import check_knobs, modelled_alike, preflight
from nvhchain.scene.kept import estimates_kept

States = tuple[Sequence[float] | None, Sequence[float] | None]
"""Further steady speeds (rad/s) and torques (N m) of the input; None without, or for the torque of the case."""

Answered = Callable[[dict[str, Any]], None]
"""Receiver of the content of summary.json before figures of the run and the page are made."""

_WRITTEN = ("summary.json", "report.html", "differences.txt", "differences.csv")

_SAME_PLACE = 1e-6
"""Distance (m) of microphones up to which they stand at one place."""

_SUFFIXES = (".json", ".txt", ".csv", ".png", ".wav", ".html")
"""Suffixes of the files that a comparison writes beside the folders of its cases."""


@runtime_checkable
class UnchangedWatcher(Watcher, Protocol):
    """Watcher that also learns that a comparison stands in its folder already."""

    def unchanged(self, folder: Path) -> None:
        """Receive the folder of a comparison for which nothing is computed."""
        ...


@checked
def compare(
    cases: Sequence[Case],
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path = "out",
    executor: Executor | None = None,
    watcher: Watcher | None = None,
    speeds: Sequence[float] | None = None,
    torques: Sequence[float] | None = None,
    answered: Answered | None = None,
) -> dict[str, Any]:
    """Run all cases with shared mesh laws, housing and transfer vectors, and write their comparison to `out`.

    Parameters
    ----------
    cases : sequence of Case
        Cases with different names that ask for `pressure`: all at constant speed, or all run-ups.
    fidelity : Fidelity
        Fidelity of all runs.
    out : str or Path
        Folder of the results.
    executor : Executor, optional
        Executor of the computing steps, as for `chain.run`.
    watcher : Watcher, optional
        Receives the progress of the steps.
    speeds : sequence of float, optional
        Further steady speeds of the input (rad/s), at which levels are computed with the same operators.
    torques : sequence of float, optional
        Torques of the input (N m) at these speeds; those of the cases by default.
    answered : callable, optional
        Receives the content of summary.json before figures of the run and the page are made.

    Returns
    -------
    dict
        Content of summary.json.

    Raises
    ------
    InputError
        If there are no cases, if cases share a name or have no pressure, or if run-ups are mixed with constant speeds.
        If the input of a run is bad.

    Notes
    -----
    Options that cases leave open are decided alike for all (`nvhchain.scene.modelled_alike`).

    The hand-offs of a case lie in out/<name>, the shared operators in out/operators. Figures (PNG), sound (WAV), table
    of differences (text, CSV), summary.json and the page report.html lie in `out` itself. Those of an earlier
    comparison are removed first. Two comparisons in one folder wait for each other.

    Nothing is computed where the folder holds this comparison already. Cases, fidelity, program and
    libraries are then the same, the cases read no files, and no file of the comparison is missing or altered.
    """
    check_comparable(cases)
    for case in cases:
        check_knobs(case, fidelity)
        if speeds is not None:
            chain.check_states(case, speeds, torques)
    out = writable_folder(out, "out")
    key = fingerprint_of(cases, fidelity, (speeds, torques))
    with hold_folder(out):
        if (standing := earlier_summary(out, key)) is not None:
            if isinstance(watcher, UnchangedWatcher):
                watcher.unchanged(out)
            if answered is not None:
                answered(standing)
            return standing
        with collected_warnings() as warnings, estimates_kept(out / OPERATORS):
            summary, results = _compared(cases, fidelity, out, executor, watcher, (speeds, torques), answered)
        keep_record(out, key, _own_files(out, results), warnings)
        return summary


def _remove_earlier(out: Path) -> None:
    """Remove what an earlier comparison wrote beside the folders of its cases; nothing without its summary.json."""
    (out / RECORD).unlink(missing_ok=True)
    try:
        names = list(json.loads((out / "summary.json").read_text(encoding="utf-8"))["configurations"])
        check_names(names, "configurations")
    except (OSError, ValueError, TypeError, KeyError, InputError, RecursionError):
        names = []
    for file in _common_files(out, names) if names else (out / "summary.json",):
        file.unlink(missing_ok=True)


def _common_files(out: Path, names: Iterable[str]) -> Iterator[Path]:
    """Yield the files that a comparison of cases of these names may write beside their folders."""
    kinds = [file.format(name) for name in names for file in ("sound-{}.wav", SURFACE)]
    yield from (out / name for name in (*_WRITTEN, TABLE, STATES, *STEADY, *RUN_UP, *kinds))


def _own_files(out: Path, results: Mapping[str, Result]) -> Iterator[Path]:
    """Yield the files of a comparison: those beside the folders, and the hand-offs and records of its cases."""
    yield from (file for file in _common_files(out, results) if file.is_file())
    shared = set[Path]()
    for name, result in results.items():
        yield from sorted(path for path in (out / name).iterdir() if path.suffix in (".h5", ".json") and path.is_file())
        given = (value if isinstance(value, tuple) else (value,) for value in vars(result).values())
        made = (origin(one) for values in given for one in values if isinstance(one, HandOff))
        shared |= {out / OPERATORS / f"{step}-{key[:10]}.h5" for step, key in filter(None, made)}
    yield from sorted(path for path in shared if path.is_file())


def _compared(
    cases: Sequence[Case],
    fidelity: Fidelity,
    out: Path,
    executor: Executor | None,
    watcher: Watcher | None,
    states: States,
    answered: Answered | None,
) -> tuple[dict[str, Any], dict[str, Result]]:
    """Run the cases and write the comparison, in a folder that no other comparison uses; return summary and results."""
    running_up = _running_up(cases)
    asked, decisions = {case.name: case for case in cases}, modelled_alike(cases, fidelity, *states)
    cases = [decisions[case.name].case if case.name in decisions else case for case in cases]
    for case in cases:
        preflight(case, fidelity, {})
    _remove_earlier(out)
    with ExitStack() as records:
        for case in cases:
            records.enter_context(recorded_case(asked[case.name], fidelity, out / case.name))
        shared: dict[str, Any] = {"operators": out / OPERATORS, "executor": executor, "watcher": watcher}
        results = {case.name: chain.run(case, fidelity=fidelity, out=out / case.name, **shared) for case in cases}
        results = {name: replace(run, decision=decisions.get(name)) for name, run in results.items()}
    maps = {} if running_up else _maps(results, states, out, out / OPERATORS, watcher)
    return _written(results, out, maps, answered), results


def _maps(
    results: Mapping[str, Result], states: States, out: Path, operators: Path, watcher: Watcher | None
) -> dict[str, Any]:
    """Return the summaries of further speeds and torques; empty without any."""
    speeds, torques = states
    return {} if speeds is None else steady_maps(results, speeds, torques, out, operators, watcher)


@one_blas_thread
def _written(
    results: Mapping[str, Result],
    out: Path,
    maps: Mapping[str, Any],
    answered: Answered | None,
) -> dict[str, Any]:
    """Write summary, table of differences, figures, sound and page; return the summary."""
    summary = write_summary(results, out, sounds=write_sounds(results, out), maps=maps)
    if answered is not None:
        answered(summary)
    for name, result in results.items():
        record_modes(result.case, fidelity=result.fidelity, out=out / name, operators=out / OPERATORS)
    _draw(results, out)
    table = plots.difference_table(summary["configurations"])
    write_text(out / "differences.txt", table.text() + "\n")
    write_text(out / "differences.csv", table.csv())
    add_balloons(out)
    write_page(out)
    return summary


def _draw(results: Mapping[str, Result], out: Path) -> None:
    """Draw the figures."""
    from nvhchain.report.pictures import compared  # opens matplotlib, after the answer

    if _running_up([result.case for result in results.values()]):
        compared.run_up_figures(results, out)
        return
    curves = {name: transmission_errors(result) for name, result in results.items()}
    with compared.surface_pictures(results, out):
        compared.steady_figures(results, curves, out)


@one_blas_thread
def write_run(result: Result, out: Path, states: States = (None, None), watcher: Watcher | None = None) -> Path:
    """Write summary.json, the sound and the page of one run.

    states (sequence of float or None, sequence of float or None): further steady speeds (rad/s) and torques (N m), as
    for `compare`.
    """
    results = {result.case.name: result}
    if not result.supplied:
        record_modes(result.case, fidelity=result.fidelity, out=out, operators=out)
    maps = _maps(results, states, out, out, watcher)
    write_summary(results, out, sounds=write_sounds(results, out), maps=maps)
    add_balloons(out)
    return write_page(out)


def check_comparable(cases: Sequence[Case]) -> None:
    """Refuse cases that cannot be compared."""
    names = [case.name for case in cases]
    require(len(names) > 0, "no cases are given: at least one is needed")
    check_names(names, "cases")
    for name in names:
        require(
            Path(name).suffix.lower() not in _SUFFIXES,
            f"name = {name!r} of a case becomes a folder beside files that end in {Path(name).suffix}: choose another",
        )
    for case in cases:
        require("pressure" in case.quantities, f"{case.name} does not ask for `pressure`: add it to quantities")
    _running_up(cases)
    _check_places(cases)


def _check_places(cases: Sequence[Case]) -> None:
    """Refuse microphones of one name at different places."""
    first: dict[str, tuple[str, tuple[float, float, float]]] = {}
    for case in cases:
        for point in case.field_points:
            other, place = first.setdefault(point.name, (case.name, point.position))
            require(
                math.dist(place, point.position) <= _SAME_PLACE,
                f"microphone {point.name} stands at {_metres(place)} in {other} and at {_metres(point.position)} in "
                f"{case.name}: put it at one place, or give it two names",
            )


def _metres(place: Sequence[float]) -> str:
    return f"({', '.join(f'{x:g}' for x in place)}) m"


def _running_up(cases: Sequence[Case]) -> bool:
    """Return True for run-ups and False for constant speeds; InputError for a mixture."""
    kinds = {case.running_up for case in cases}
    require(len(kinds) == 1, "run-ups and constant speeds cannot be compared: give one kind of cases")
    return kinds == {True}
