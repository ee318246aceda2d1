"""Comparison of several configurations: one run each, shared operators, figures, sound and summary.json."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain import chain, levels, plots
from nvhchain.case import Case, GearboxCase
from nvhchain.chain.result import Result
from nvhchain.error_band import ErrorBand
from nvhchain.errors import require
from nvhchain.fidelity import STANDARD, Fidelity
from nvhchain.files.folder_lock import hold_folder
from nvhchain.files.hdf5 import writable_folder, write_text
from nvhchain.files.result_cache import Watcher
from nvhchain.gear import quasi_static_transmission_error
from nvhchain.handoff import FieldPressure
from nvhchain.interop import write_wav
from nvhchain.interop.wav import SAMPLE_RATE
from nvhchain.kinds import checked
from nvhchain.names import check_names
from nvhchain.plots.files import save
from nvhchain.report.limits import limits
from nvhchain.report.marks import order_marks
from nvhchain.report.page import write_page
from nvhchain.report.run_up import compare_run_ups

OPERATORS = "operators"
"""Name of the folder of operators that the cases of a comparison share."""

_SUFFIXES = (".json", ".txt", ".csv", ".png", ".wav", ".html")
"""Suffixes of the files that a comparison writes beside the folders of its cases."""


@checked
def compare(
    cases: Sequence[Case],
    *,
    fidelity: Fidelity = STANDARD,
    out: str | Path = "out",
    executor: Executor | None = None,
    watcher: Watcher | None = None,
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
    The hand-offs of a case lie in out/<name>, the shared operators in out/operators. Figures (PNG), sound (WAV),
    summary.json and the page report.html lie in `out` itself. At constant speed the table of differences (text, CSV)
    is added. Two comparisons in one folder wait for each other.
    """
    check_comparable(cases)
    out = writable_folder(out, "out")
    with hold_folder(out):
        return _compared(cases, fidelity, out, executor, watcher)


def _compared(
    cases: Sequence[Case], fidelity: Fidelity, out: Path, executor: Executor | None, watcher: Watcher | None
) -> dict[str, Any]:
    """Run the cases and write the comparison, in a folder that no other comparison uses."""
    running_up = _running_up(cases)
    (out / "summary.json").unlink(missing_ok=True)
    results = {
        case.name: chain.run(
            case,
            fidelity=fidelity,
            out=out / case.name,
            operators=out / OPERATORS,
            executor=executor,
            watcher=watcher,
        )
        for case in cases
    }
    configurations = compare_run_ups(results, out) if running_up else _steady(results, out)
    summary = {
        "fidelity": fidelity.name,
        "field_point": dict(zip(("name", "position_m"), _first_point(cases[0]), strict=True)),
        "configurations": configurations,
        "assumptions": {case.name: case.assumptions for case in cases if isinstance(case, GearboxCase)},
    }
    write_text(out / "summary.json", json.dumps(summary, indent=1) + "\n")
    write_page(out)
    return summary


def check_comparable(cases: Sequence[Case]) -> None:
    """Refuse cases that cannot be compared.

    Parameters
    ----------
    cases : sequence of Case
        Cases of one comparison.

    Raises
    ------
    InputError
        If there are no cases, if cases share a name, if one does not ask for `pressure`, or if run-ups are mixed with
        constant speeds.
    """
    names = [case.name for case in cases]
    require(len(names) > 0, "no cases are given: at least one is needed")
    check_names(names, "cases")
    for name in names:
        require(
            Path(name).suffix.lower() not in _SUFFIXES,
            f"name = {name!r} of a case becomes a folder beside files that end in {Path(name).suffix}: choose another",
        )
    for case in cases:
        require("pressure" in case.quantities, f"{case.name} does not ask for `pressure`, which is what is compared")
    _running_up(cases)


def _running_up(cases: Sequence[Case]) -> bool:
    """Return True for run-ups and False for constant speeds; InputError for a mixture."""
    kinds = {isinstance(case, GearboxCase) and case.operation.ramp is not None for case in cases}
    require(len(kinds) == 1, "run-ups and constant speeds cannot be compared: give one kind of cases")
    return kinds == {True}


def _steady(results: Mapping[str, Result], out: Path) -> dict[str, Any]:
    """Write table, figures and sound at constant speed; return the summary of every configuration.

    Pictures of the surface take seconds each. One thread renders them in turn while the rest is made.
    """
    with ThreadPoolExecutor(max_workers=1) as beside:
        pictures = {
            name: beside.submit(plots.rendered_surface, result.surface_velocity)
            for name, result in results.items()
            if result.surface_velocity is not None
        }
        try:
            configurations = _write_configurations(results, out)
        except BaseException:
            beside.shutdown(wait=False, cancel_futures=True)
            raise
        for name, picture in pictures.items():
            velocity, image = results[name].surface_velocity, picture.result()
            assert velocity is not None
            axes = plots.surface_velocity(velocity, name=name, image=image, engine="matplotlib")
            save([axes], out / f"surface_velocity-{name}.png")
    return configurations


def _write_configurations(results: Mapping[str, Result], out: Path) -> dict[str, Any]:
    """Write everything except pictures of the surface; return the summary of every configuration."""
    pressures = {name: result.pressure for name, result in results.items() if result.pressure is not None}
    configurations = {name: summarise(pressure) | limits(results[name]) for name, pressure in pressures.items()}
    table = plots.difference_table(configurations)
    write_text(out / "differences.txt", table.text() + "\n")
    write_text(out / "differences.csv", table.csv())
    _figures(results, pressures, out)
    steady = {name: pressure for name, pressure in pressures.items() if pressure.input_speed}
    full_scale = 1.05 * max((_peak(pressure) for pressure in steady.values()), default=0.0)
    for name, pressure in steady.items():
        write_wav(pressure, out / f"sound-{name}.wav", full_scale=full_scale)
    return configurations


def summarise(pressure: FieldPressure) -> dict[str, Any]:
    """Return speed, overall level in dB(A) and the level of every line at the first field point.

    Orders are those of the input shaft; without an input speed the list is empty.
    """
    turns = pressure.input_speed / (2 * pi)
    level = levels.decibel(pressure.pressure[:, 0])
    return {
        "input_speed_rpm": 60 * turns,
        "overall_dBA": float(levels.overall(pressure.frequency, pressure.pressure[:, 0])),
        "orders": [
            {"order": round(float(f / turns), 9), "frequency_hz": float(f), "level_db": float(db)}
            for f, db in zip(pressure.frequency, level, strict=True)
        ]
        if turns
        else [],
    }


def _figures(results: Mapping[str, Result], pressures: Mapping[str, FieldPressure], out: Path) -> None:
    marks = order_marks([result.case for result in results.values()])
    bands = {name: band for name in pressures if isinstance(band := results[name].error_band, ErrorBand)}
    save(plots.pressure_spectrum(pressures, marks=marks, bands=bands), out / "pressure_spectrum.png")
    steady = {name: pressure for name, pressure in pressures.items() if pressure.input_speed}
    if steady:
        save(plots.pressure_history(steady), out / "pressure_history.png")
    spectra = {name: r.force_spectrum for name, r in results.items() if r.force_spectrum is not None}
    if spectra:
        save(plots.bearing_force_spectra(spectra, marks=marks), out / "bearing_forces.png")
    errors = _transmission_errors(results)
    if errors:
        save(plots.transmission_errors(errors), out / "transmission_errors.png")


def _transmission_errors(results: Mapping[str, Result]) -> dict[str, dict[str, Any]]:
    """Return the quasi-static transmission error of every stage in every configuration: the limit of low speed."""
    stages: dict[str, dict[str, Any]] = {}
    for name, result in results.items():
        if not isinstance(result.case, GearboxCase):
            continue
        for stage, law, force in zip(result.case.stages, result.mesh_laws, result.case.mesh_forces, strict=False):
            stages.setdefault(stage.name, {})[name] = quasi_static_transmission_error(law, force)
    return stages


def _first_point(case: Case) -> tuple[str, list[float]]:
    return case.field_points[0].name, list(case.field_points[0].position)


def _peak(pressure: FieldPressure) -> float:
    _, signal = levels.time_history(pressure.frequency, pressure.pressure[:, 0], sample_rate=SAMPLE_RATE)
    return float(np.abs(signal).max())
