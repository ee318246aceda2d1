"""Functions of the commands: each returns the exit code; heavy packages are imported on demand."""

from __future__ import annotations

import argparse
import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from math import inf, pi, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nvhchain.cli.answers import doctor_answer, plan_answer, run_answer
from nvhchain.cli.changes import changed_case, changed_knobs
from nvhchain.cli.console import Console
from nvhchain.cli.output import show
from nvhchain.cli.sound import check_enforced, show_targets
from nvhchain.errors import InputError, counted, require
from nvhchain.fidelity import PRESETS, Fidelity

if TYPE_CHECKING:
    from nvhchain.case import Case
    from nvhchain.handoff import BearingForces


def _fidelity(options: argparse.Namespace, cases: Sequence[Case], supplied: Collection[str] = ()) -> Fidelity:
    """Return the preset or the planner's choice, with the requested tolerance of the housing's modes.

    The planner's choice concerns steps that are not `supplied`. It is printed on stderr.
    """
    fidelity = PRESETS[options.fidelity]
    if options.tolerance_db is not None:
        from nvhchain.tradeoff import cheapest

        choice = cheapest(cases, options.tolerance_db, supplied=supplied)
        show(choice, error=True)
        fidelity = choice.fidelity
    return changed_knobs(fidelity, options)


def _out(options: argparse.Namespace, case: Case) -> Path:
    return Path(options.out or Path("out") / case.name)


def _given(options: argparse.Namespace) -> dict[str, Any]:
    """Return the supplied hand-offs of `--use` as arguments of a run."""
    from nvhchain.chain import supplied
    from nvhchain.files import hdf5

    return supplied.arguments(hdf5.load(path) for path in options.use)


def _show_each(lines: Iterable[object], before: str = "") -> None:
    for line in lines:
        show(f"{before}{line}")


def _report_wider_limits(tolerance: float | None, name: str, widest: float) -> None:
    """Report on stderr limits of the run (dB to one side) that are wider than requested."""
    if tolerance is not None and widest > tolerance:
        open_ = f"leaves {widest:.1f} dB open to one side" if widest < inf else "has no lower limit"
        show(
            f"{name}: the error band of this run {open_}, more than the {tolerance:g} dB asked for: those are "
            "what a sweep promises, the band is what the run itself can vouch for",
            error=True,
        )


def _executor(options: argparse.Namespace) -> AbstractContextManager[Executor | None]:
    """Return the executor of the named workers or scheduler, if any."""
    if options.workers is None and options.scheduler is None:
        return nullcontext()
    from nvhchain.runtime import cluster

    return cluster.connect(options.scheduler) if options.scheduler else cluster.local_cluster(options.workers)


def _imported_forces(path: Path, case: Case) -> BearingForces:
    """Return bearing forces from another program's file; the .toml file of the same name describes its channels."""
    from nvhchain.case import GearboxCase, load_channels
    from nvhchain.interop import read_bearing_forces

    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} has no bearings: --forces belongs to a gearbox")
    return read_bearing_forces(path, load_channels(path.with_suffix(".toml")), positions=case.seats)


def _states(
    options: argparse.Namespace, cases: Sequence[Case]
) -> tuple[tuple[float, ...] | None, tuple[float, ...] | None]:
    """Return speeds (rad/s) and torques (N m) of `--speeds` and `--torques`, refused before anything is computed."""
    from nvhchain.chain import check_states

    speeds, torques = options.speeds, options.torques
    require(torques is None or speeds is not None, "--torques needs --speeds: give both, or the torques in a study")
    if speeds is None:
        return None, None
    turning = tuple(rpm * pi / 30.0 for rpm in speeds)
    for case in cases:
        check_states(case, turning, torques)
    return turning, torques


def new(options: argparse.Namespace) -> int:
    """Copy an example case into a folder, to be changed."""
    from nvhchain.cli.examples import copy_example

    case, *bases = copy_example(options.example, Path(options.folder))
    show(f"{case}" + (f", based on {', '.join(map(str, bases))}" if bases else ""))
    show(f"Change it, then: nvhchain check {case}; nvhchain plan {case}; nvhchain run {case} --fidelity draft")
    return 0


def _show_assumptions(case: Case) -> None:
    """Print what the case assumes, such as a housing drawn by rule."""
    _show_each(case.assumptions, f"{case.name}: ")


def run(options: argparse.Namespace) -> int:
    """Compute the results of a case; print levels with their limits, and write the error bands of every line."""
    from nvhchain.scene.kept import estimates_kept

    case = changed_case(options)
    check_enforced(options.enforce, [case])
    out = _out(options, case)
    with estimates_kept(out):
        return _run(options, case, out)


def _run(options: argparse.Namespace, case: Case, out: Path) -> int:
    """Decide what a case needs, and run it."""
    from nvhchain.files.hdf5 import writable_folder
    from nvhchain.runtime.folder_lock import hold_folder
    from nvhchain.scene import modelled_alike, preflight

    given = _given(options)
    if options.forces:
        given["bearing_forces"] = _imported_forces(Path(options.forces), case)
    states = _states(options, [case])
    fidelity = _fidelity(options, [case], given)
    preflight(case, fidelity, given)
    decides = states[0] is not None and not {"bearing_forces", "force_spectrum", "surface_velocity"} & set(given)
    decision = modelled_alike([case], fidelity, *states)[case.name] if decides else None
    with hold_folder(writable_folder(out, "out")):
        return _run_here(options, case, fidelity, given, out, states, decision)


def _run_here(
    options: argparse.Namespace, case: Case, fidelity: Fidelity, given: Any, out: Path, states: Any, decision: Any
) -> int:
    """Run a case in a folder that no other command uses."""
    from nvhchain import chain
    from nvhchain.chain.prefetch import operators_ahead
    from nvhchain.error_band import format_level, limit_causes, save_error_bands
    from nvhchain.report import recorded_case, write_run
    from nvhchain.report.page.sections.lines.levels import UNITS

    decided, watcher = decision.case if decision else case, Console()
    with (
        recorded_case(case, fidelity, out),
        _executor(options) as executor,
        nullcontext() if executor or given else operators_ahead([case], fidelity, out, watcher, states),
    ):
        result = chain.run(decided, fidelity=fidelity, out=out, executor=executor, watcher=watcher, **given)
    result = replace(result, decision=decision or result.decision)
    save_error_bands(result.error_bands, out)
    options.answer = run_answer(result, out)
    widths = [float(abs(band.overall - band.level[:, None]).max()) for band in result.error_bands.values()]
    _report_wider_limits(options.tolerance_db, case.name, max(widths))
    silent = [quantity for quantity in case.quantities if quantity in ("bearing_forces", "surface_velocity")]
    if silent:
        show(f"{case.name}: {', '.join(silent)} in {out}")
    for quantity, (name, unit) in UNITS.items():
        if quantity in result.error_bands:
            band = result.error_bands[quantity]
            most = int(band.level.argmax())
            show(f"{case.name}: {name} {format_level(band.level[most], unit, band.overall[most])}")
            if quantity == "sound_power" or "pressure" not in result.error_bands:
                show(f"Limits of the {name}{limit_causes(band, most)}")
    if result.radiation_efficiency is not None:
        efficiency = result.radiation_efficiency.efficiency
        show(f"{case.name}: radiation efficiency {efficiency.min():.3g}…{efficiency.max():.3g}")
    if result.directivity is not None:
        for point, index in zip(case.field_points, result.directivity.index.T, strict=True):
            show(f"{case.name}: directivity index {index.min():.1f}…{index.max():.1f} dB at {point.name}")
    if "pressure" in result.error_bands:
        for point, heard, limits in zip(case.field_points, result.overall, result.error_band.overall, strict=True):
            show(f"{case.name}: {format_level(heard, 'dB(A)', limits)} at {point.name}")
        show(f"Limits at {case.field_points[0].name}{limit_causes(result.error_band, 0)}")
    show(f"Figures, sound and tables: {write_run(result, out, states, watcher)}")
    _show_assumptions(case)
    _show_each(result.modelling.sentences if result.modelling is not None else (), f"{case.name}: ")
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    options.answer["targets"] = summary["configurations"][case.name].get("targets", [])
    return show_targets(summary, enforce=options.enforce)


def record(options: argparse.Namespace) -> int:
    """Write the bearing forces of a run-up into files."""
    from nvhchain import chain

    case = changed_case(options)
    given = _given(options)
    useless = sorted(set(given) - {"mesh_laws", "load_distributions", "housing"})
    if useless:
        raise InputError(f"--use: {', '.join(useless)} is not taken by a record of bearing forces: leave it out")
    out = _out(options, case)
    with _executor(options) as executor:
        made = chain.record(
            case, fidelity=_fidelity(options, [case], given), out=out, executor=executor, watcher=Console(), **given
        )
    show(f"{case.name}: {len(made.paths)} file(s) of bearing forces in {made.paths[0].parent}")
    _show_assumptions(case)
    return 0


def compare(options: argparse.Namespace) -> int:
    """Compute several cases and write their comparison."""
    from nvhchain.chain.running import OPERATORS
    from nvhchain.scene.kept import estimates_kept

    with estimates_kept(Path(options.out) / OPERATORS):
        return _compare(options)


def _compare(options: argparse.Namespace) -> int:
    """Check cases, fidelity and states, and compare."""
    from nvhchain.chain.prefetch import operators_ahead
    from nvhchain.chain.running import OPERATORS
    from nvhchain.report import check_comparable, compare, stands_already

    cases = [changed_case(options, path) for path in options.cases]
    check_comparable(cases)
    check_enforced(options.enforce, cases)
    states = _states(options, cases)
    fidelity, out, watcher = _fidelity(options, cases), Path(options.out), Console()
    idle = stands_already(cases, fidelity, out, states)
    with (
        nullcontext() if idle else _executor(options) as executor,
        nullcontext() if idle or executor else operators_ahead(cases, fidelity, out / OPERATORS, watcher, states),
    ):
        speeds, torques = states
        work: dict[str, Any] = {"executor": executor, "watcher": watcher, "speeds": speeds, "torques": torques}
        summary = compare(cases, fidelity=fidelity, out=out, answered=partial(_show_verdict, options, cases), **work)
    show(f"Figures, sound and tables: {out / 'report.html'}")
    return show_targets(summary, enforce=options.enforce)


def _show_verdict(options: argparse.Namespace, cases: Sequence[Case], summary: Mapping[str, Any]) -> None:
    """Print the levels of a comparison and the verdict, while figures and page are still to be made."""
    from nvhchain.error_band import format_level
    from nvhchain.report import verdict

    for name, configuration in summary["configurations"].items():
        edges, level = configuration["error_band_dBA"], configuration["overall_dBA"]
        widest = max(inf if edge is None else abs(edge - level) for edge in edges)
        _report_wider_limits(options.tolerance_db, name, widest)
        show(f"{name}: {format_level(level, 'dB(A)', edges)}")
    _show_each(verdict(summary))
    for case in cases:
        _show_assumptions(case)
        _show_each(summary["modelling"].get(case.name, {}).get("sentences", ()), f"{case.name}: ")


def plot(options: argparse.Namespace) -> int:
    """Draw hand-offs, or a case."""
    from nvhchain.report import draw, draw_case

    picture = options.out or options.files[0].with_suffix(".png")
    angle = radians(options.wheel_angle)
    if options.files[0].suffix == ".toml":
        if len(options.files) > 1:
            raise InputError(f"{len(options.files)} files: a figure shows one case")
        fidelity = PRESETS[options.fidelity]
        draw_case(options.files[0], picture, fidelity, stage=options.stage, gear_name=options.gear, angle=angle)
        show(picture)
        return 0
    if options.stage or options.gear or angle:
        raise InputError(f"{options.files[0]}: --stage, --gear and --wheel-angle belong to a case (.toml)")
    shown = {"quantity": options.quantity, "angle": options.angle}
    draw(options.files, picture, orders=options.orders, frequency=options.at, **shown)
    show(picture)
    return 0


def gear_field(options: argparse.Namespace) -> int:
    """Write displacement and stress of a gear."""
    from nvhchain.case import GearboxCase
    from nvhchain.files import hdf5
    from nvhchain.report import loaded_gear

    case = changed_case(options)
    if not isinstance(case, GearboxCase):
        raise InputError(f"{options.case}: {case.name} is a radiator: it has no gears")
    fidelity, angle = _fidelity(options, [case]), radians(options.wheel_angle)
    require(options.out.suffix == ".h5", f"--out {options.out}: the field is written as HDF5: end it in .h5")
    made = loaded_gear(case, fidelity, options.gear, stage=options.stage, angle=angle)
    hdf5.save(made, options.out)
    teeth = ", ".join(str(tooth) for tooth in made.loaded_teeth)
    moved = 1e6 * float((made.displacement**2).sum(axis=1).max()) ** 0.5
    stress = 1e-6 * float(made.stress_away_from_contact().max())
    show(
        f"{options.out}: {options.gear}, teeth {teeth} loaded, displacement up to {moved:.3g} µm, "
        f"von Mises stress up to {stress:.3g} MPa away from the contact"
    )
    return 0


def contributions(options: argparse.Namespace) -> int:
    """Write tables and bars of the contributions of paths, modes and panels."""
    from nvhchain.report import contributions

    case = changed_case(options)
    given = _given(options)
    out = _out(options, case)
    fidelity = _fidelity(options, [case], given)
    chosen = {"frequency": options.at, "order": options.order}
    found = contributions(case, fidelity=fidelity, out=out, **chosen, supplied=given, watcher=Console())
    _show_each(out / f"contributions-{kind}.csv" for kind in found)
    return 0


def craig_bampton(options: argparse.Namespace) -> int:
    """Export the housing's matrices."""
    from nvhchain.report import export_craig_bampton

    case = changed_case(options)
    made = export_craig_bampton(case, options.out, fidelity=_fidelity(options, [case]), modes_to=options.modes_to)
    show(f"{options.out}: {counted(len(made.names), 'seat')}, {counted(len(made.interface_frequency), 'mode')}")
    return 0


def report(options: argparse.Namespace) -> int:
    """Write the page of a run or comparison, finished or not."""
    from nvhchain.report import write_page

    if options.surface_pressure is not None:
        from nvhchain.report.surface_pressure import add_surface_pressure

        for line in add_surface_pressure(options.folder, options.surface_pressure):
            show(line)
    show(write_page(options.folder))
    return 0


def tables(options: argparse.Namespace) -> int:
    """Write the tables and curves of a run or comparison."""
    from nvhchain.report.page.tables import write_tables

    written = write_tables(options.folder, options.out)
    options.answer = {"files": [str(path) for path in written]}
    _show_each(written)
    return 0


def tradeoff(options: argparse.Namespace) -> int:
    """Measure the knobs of a case."""
    from nvhchain import tradeoff
    from nvhchain.report import write_page

    case = changed_case(options)
    out = Path(options.out or Path("out") / f"tradeoff-{case.name}")
    sweep = tradeoff.tradeoff(
        case, out=out, fidelity=PRESETS[options.fidelity], knobs=options.knob, progress=_variants, watcher=Console()
    )
    tradeoff.save_tradeoff(sweep, out)
    write_page(out)
    options.answer = {"folder": str(out), **json.loads(tradeoff.as_json(sweep))}
    show(tradeoff.markdown(sweep), end="")
    return 0


def _variants(done: int, total: int) -> None:
    show(f"variant {done} of {total}", error=True)


def plan(options: argparse.Namespace) -> int:
    """Print the planned work; refuse knobs that `run` would refuse."""
    from nvhchain.chain.cached import cached_results
    from nvhchain.chain.running import OPERATORS
    from nvhchain.scene import check_knobs, plan

    case = changed_case(options)
    fidelity = _fidelity(options, [case])
    check_knobs(case, fidelity)
    planned = plan(case, fidelity=fidelity)
    out, compared = _out(options, case), Path(options.out or "out")
    operators = out
    if (compared / OPERATORS).is_dir() and not (out / "error_bands.json").is_file():  # of `compare`
        out, operators = compared / case.name, compared / OPERATORS
    cached = cached_results(case, fidelity=fidelity, out=out, operators=operators)
    planned = replace(planned, cached=frozenset(cached))
    options.answer = plan_answer(planned)
    show(planned)
    return 0


def check(options: argparse.Namespace) -> int:
    """Read and validate a case and the file of its housing."""
    from nvhchain.case import GearboxCase
    from nvhchain.scene import check_case, option_lines
    from nvhchain.scene.bearing_lines import bearing_lines, deviation_lines

    case = changed_case(options)
    check_case(case)
    lines = option_lines(case, changed_knobs(PRESETS["standard"], options))
    options.answer = {"case": case.name, "file": options.case, "valid": True, "options": list(lines)}
    show(f"{options.case}: {case.name} is valid")
    if isinstance(case, GearboxCase):
        speeds = "…".join(f"{30 / pi * speed:.5g}" for speed in dict.fromkeys(case.speeds))
        show(f"{case.name}: the input turns at {speeds} rpm under {case.operation.input_torque:g} N m")
        drawn = (gear.drawing_line for gear in case.gears)
        _show_each((*drawn, *bearing_lines(case), *deviation_lines(case)), f"{case.name}: ")
    elif not case.moves:
        show(f"{case.name}: the body is at rest: give the run its velocity with --use FILE")
    _show_assumptions(case)
    _show_each(lines, f"{case.name}: ")
    return 0


def schema(options: argparse.Namespace) -> int:
    """Print the JSON Schema of case files, or write it."""
    from nvhchain.case.toml.schema import schema_text
    from nvhchain.files.atomic_write import write_output

    if options.out is None:
        show(schema_text(), end="")
    else:
        show(write_output(options.out, schema_text().encode()))
    return 0


def completion(options: argparse.Namespace) -> int:
    """Print the script that completes commands in a shell."""
    from nvhchain.runtime.extras import check_installed

    check_installed("shtab")
    import shtab

    show(shtab.complete(options.parser, shell=options.shell))
    return 0


def doctor(options: argparse.Namespace) -> int:
    """Check this machine."""
    from nvhchain.doctor import diagnose, diagnose_acoustics

    findings = tuple(diagnose_acoustics() if options.acoustics else diagnose())
    options.answer = doctor_answer(findings)
    for finding in findings:
        mark = "ok  " if finding.ok else "FAIL"
        show(f"{mark} {finding.name}: {finding.detail}" + ("" if finding.ok else f"; {finding.remedy}"))
    return 0 if all(finding.ok for finding in findings) else 1
