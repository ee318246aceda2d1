"""Command line.  Exit code 0: everything asked for is there; 2: bad input."""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from nvhchain import __version__
from nvhchain.errors import InputError, SolverError
from nvhchain.fidelity import PRESETS, Fidelity

if TYPE_CHECKING:
    from nvhchain.case import Case
    from nvhchain.handoff import BearingForces


class Console:
    """Progress on stderr: bars with remaining time on a terminal, one line per finished stage elsewhere."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._started = 0.0

    def begin(self, stage: str) -> None:
        self._started = time.perf_counter()
        if sys.stderr.isatty():
            from tqdm import tqdm

            self._bar = tqdm(
                desc=stage, total=1, leave=False, bar_format="{desc}: {percentage:3.0f}% |{bar}| {remaining}"
            )

    def step(self, stage: str, done: int, total: int) -> None:
        if self._bar is not None:
            self._bar.total, self._bar.n = total, done
            self._bar.refresh()

    def end(self, stage: str, how: str) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        seconds = f" in {time.perf_counter() - self._started:.1f} s" if how == "computed" else ""
        print(f"{stage}: {how}{seconds}", file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            return int(options.action(options))
    except InputError as error:
        print(f"nvhchain: {_one_line(error)}", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"nvhchain: out of memory ({_one_line(error)}): choose a lower fidelity", file=sys.stderr)
        return 2
    except (SolverError, OSError) as error:
        print(f"nvhchain: {_one_line(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("nvhchain: interrupted; finished stages are kept and will be found again", file=sys.stderr)
        return 130


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    """What may be wrong with a result, in one line."""
    print(f"nvhchain: {' '.join(str(message).split())}", file=sys.stderr, flush=True)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, with exit code 2."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="nvhchain", description="Gear geometry to sound pressure.")
    parser.add_argument("--version", action="version", version=f"nvhchain {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    common = _Parser(add_help=False)
    accuracy = common.add_mutually_exclusive_group()
    accuracy.add_argument("--fidelity", choices=list(PRESETS), default="standard", help="accuracy preset")
    accuracy.add_argument(
        "--tolerance-db",
        metavar="X",
        type=float,
        help="the cheapest knobs that keep to X dB against `reference`, by measured tables",
    )

    common.add_argument(
        "--mode-tolerance-db",
        metavar="X",
        type=float,
        help="as few modes of the housing as keep the velocity of its surface to X dB (default: as many as the preset)",
    )

    spread = _Parser(add_help=False)
    where = spread.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="N", type=int, help="spread the work over N processes of this machine")
    where.add_argument("--scheduler", metavar="ADDRESS", help="spread the work over a dask scheduler, tcp://HOST:PORT")

    run = commands.add_parser("run", parents=[common, spread], help="compute the sound pressure of a case")
    run.add_argument("case", metavar="CASE", help="case file (TOML)")
    run.add_argument("--out", metavar="DIR", help="folder for the hand-offs (default: out/<case name>)")
    run.add_argument(
        "--use",
        metavar="FILE",
        action="append",
        default=[],
        help="ready-made hand-off (HDF5) to take instead of computing it",
    )
    run.add_argument(
        "--forces",
        metavar="FILE",
        help="bearing forces of another program (CSV, MAT, HDF5, UFF 58), described in the TOML file beside it",
    )
    run.set_defaults(action=_run)

    compare = commands.add_parser(
        "compare", parents=[common, spread], help="compare cases: figures, sound, summary.json"
    )
    compare.add_argument("cases", metavar="CASE", nargs="+", help="case files (TOML); the first is the base")
    compare.add_argument("--out", metavar="DIR", default="out", help="folder for results (default: out)")
    compare.set_defaults(action=_compare)

    plot = commands.add_parser("plot", help="draw hand-offs of one kind into one figure")
    plot.add_argument("files", metavar="FILE", nargs="+", type=Path, help="hand-offs (HDF5)")
    plot.add_argument("--orders", action="store_true", help="records against order of the input, not frequency")
    plot.add_argument(
        "--quantity",
        choices=["force", "transmission_error", "mesh_deflection", "output_lag"],
        default="force",
        help="of records of bearing forces",
    )
    plot.add_argument(
        "--at", metavar="HZ", type=float, nargs="+", default=[], help="modes of a housing, line of a surface velocity"
    )
    plot.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="figure (PNG, default: beside the first file), or motion of a housing: .gif, .vtu, .vtkhdf, .csv (MAC)",
    )
    plot.set_defaults(action=_plot)

    parts = commands.add_parser(
        "contributions", parents=[common], help="what modes and panels of the housing add to the sound"
    )
    parts.add_argument("case", metavar="CASE")
    parts.add_argument("--use", metavar="FILE", action="append", default=[], help="ready-made hand-off, as for `run`")
    parts.add_argument("--at", metavar="HZ", type=float, help="line of the bars (default: the loudest)")
    parts.add_argument("--out", metavar="DIR", help="folder of the run and its tables (default: out/<case name>)")
    parts.set_defaults(action=_contributions)

    exchange = commands.add_parser(
        "craig-bampton", parents=[common], help="hand the housing's mass and stiffness at its seats to other programs"
    )
    exchange.add_argument("case", metavar="CASE")
    exchange.add_argument(
        "--modes-to", metavar="HZ", type=float, required=True, help="modes with held seats up to here: 4 times the band"
    )
    exchange.add_argument("--out", metavar="FILE", type=Path, required=True, help="MATLAB .mat or Nastran .bdf (DMIG)")
    exchange.set_defaults(action=_craig_bampton)

    report = commands.add_parser("report", help="make a page (HTML) of what `compare` left in a folder")
    report.add_argument("folder", metavar="DIR")
    report.set_defaults(action=_report)

    tradeoff = commands.add_parser("tradeoff", help="measure what each knob of the fidelity costs and saves")
    tradeoff.add_argument("case", metavar="CASE")
    tradeoff.add_argument(
        "--fidelity", choices=list(PRESETS), default="reference", help="the yardstick, from which knobs are turned"
    )
    tradeoff.add_argument(
        "--knob", metavar="NAME", action="append", help="a knob (gear.slices), a stage or `preset` (default: all)"
    )
    tradeoff.add_argument(
        "--out", metavar="DIR", help="folder for the measurements (default: out/tradeoff-<case name>)"
    )
    tradeoff.set_defaults(action=_tradeoff)

    plan = commands.add_parser("plan", parents=[common], help="say what will be modelled, skipped, and what it takes")
    plan.add_argument("case", metavar="CASE")
    plan.set_defaults(action=_plan)

    check = commands.add_parser("check", help="read and validate a case")
    check.add_argument("case", metavar="CASE")
    check.set_defaults(action=_check)

    doctor = commands.add_parser("doctor", help="check this machine: packages, system libraries, compiler cache")
    doctor.add_argument("--acoustics", action="store_true", help="compare the boundary element engines on a small body")
    doctor.set_defaults(action=_doctor)
    return parser


def _fidelity(options: argparse.Namespace, cases: Sequence[Case]) -> Fidelity:
    """The preset, or what the planner chooses, which is said on stderr; modes of the housing as they are asked for."""
    if options.tolerance_db is None:
        return _with_mode_tolerance(PRESETS[options.fidelity], options.mode_tolerance_db, cases)
    from nvhchain.tradeoff import cheapest

    choice = cheapest(cases, options.tolerance_db)
    print(choice, file=sys.stderr, flush=True)
    return _with_mode_tolerance(choice.fidelity, options.mode_tolerance_db, cases)


def _with_mode_tolerance(fidelity: Fidelity, tolerance: float | None, cases: Sequence[Case]) -> Fidelity:
    from nvhchain.housing import Casting

    if tolerance is None:
        return fidelity
    for case in cases:
        if not isinstance(getattr(case, "housing", None), Casting):
            raise InputError(f"--mode-tolerance-db: {case.name} has no casting, whose modes could be counted by it")
    if not tolerance > 0:
        raise InputError(f"--mode-tolerance-db = {tolerance:g} must be positive: leave it out for the preset's modes")
    return replace(fidelity, housing=replace(fidelity.housing, truncation_tolerance_db=tolerance))


def _executor(options: argparse.Namespace) -> AbstractContextManager[Executor | None]:
    """Where the work goes: nowhere but here, unless workers or a scheduler are named."""
    if options.workers is None and options.scheduler is None:
        return nullcontext()
    from nvhchain import cluster

    return cluster.connect(options.scheduler) if options.scheduler else cluster.local_cluster(options.workers)


def _foreign_forces(path: Path, case: Case) -> BearingForces:
    """Bearing forces from another program's file; their channels are described in a file of the same name, .toml."""
    from nvhchain.case import GearboxCase, load_channels
    from nvhchain.interop import read_bearing_forces

    if not isinstance(case, GearboxCase):
        raise InputError(f"{case.name} has no bearings: --forces belongs to a gearbox")
    return read_bearing_forces(path, load_channels(path.with_suffix(".toml")), positions=case.seats)


def _run(options: argparse.Namespace) -> int:
    from nvhchain import chain, ready_made, store
    from nvhchain.case import load_case
    from nvhchain.error_band import format_limits

    case = load_case(options.case)
    given = ready_made.arguments(store.load(path) for path in options.use)
    if options.forces:
        given["bearing_forces"] = _foreign_forces(Path(options.forces), case)
    out = Path(options.out or Path("out") / case.name)
    with _executor(options) as executor:
        result = chain.run(
            case, fidelity=_fidelity(options, [case]), out=out, executor=executor, watcher=Console(), **given
        )
    silent = [quantity for quantity in case.quantities if quantity in ("bearing_forces", "surface_velocity")]
    if silent:
        print(f"{case.name}: {', '.join(silent)} in {out}")
    units = {
        "bearing_forces": ("largest bearing force", "dB re 1 µN"),
        "surface_velocity": ("surface velocity", "dB re 1 nm/s"),
        "sound_power": ("sound power", "dB(A) re 1 pW"),
    }
    for quantity in (asked for asked in case.quantities if asked in units):
        name, unit = units[quantity]
        band = result.error_bands[quantity]
        most = int(band.level.argmax())
        print(f"{case.name}: {name} {band.level[most]:.1f} {unit} ({format_limits(band.overall[most])})")
    if result.radiation_efficiency is not None:
        efficiency = result.radiation_efficiency.efficiency
        print(f"{case.name}: radiation efficiency {efficiency.min():.3g}…{efficiency.max():.3g}")
    if result.directivity is not None:
        for point, index in zip(case.field_points, result.directivity.index.T, strict=True):
            print(f"{case.name}: directivity index {index.min():.1f}…{index.max():.1f} dB at {point.name}")
    if "pressure" in case.quantities:
        for point, heard, limits in zip(case.field_points, result.overall, result.error_band.overall, strict=True):
            print(f"{case.name}: {heard:.1f} dB(A) ({format_limits(limits)}) at {point.name}")
    return 0


def _compare(options: argparse.Namespace) -> int:
    from nvhchain.case import load_case
    from nvhchain.report import compare

    cases = [load_case(path) for path in options.cases]
    with _executor(options) as executor:
        summary = compare(
            cases, fidelity=_fidelity(options, cases), out=Path(options.out), executor=executor, watcher=Console()
        )
    for name, configuration in summary["configurations"].items():
        print(f"{name}: {configuration['overall_dBA']:.1f} dB(A)")
    return 0


def _plot(options: argparse.Namespace) -> int:
    from nvhchain.report import draw

    picture = options.out or options.files[0].with_suffix(".png")
    draw(options.files, picture, orders=options.orders, at=options.at, quantity=options.quantity)
    print(picture)
    return 0


def _contributions(options: argparse.Namespace) -> int:
    from nvhchain import ready_made, store
    from nvhchain.case import load_case
    from nvhchain.report import contributions

    case = load_case(options.case)
    given = ready_made.arguments(store.load(path) for path in options.use)
    out = Path(options.out or Path("out") / case.name)
    fidelity = _fidelity(options, [case])
    found = contributions(case, fidelity=fidelity, out=out, at=options.at, given=given, watcher=Console())
    for kind in found:
        print(out / f"contributions-{kind}.csv")
    return 0


def _craig_bampton(options: argparse.Namespace) -> int:
    from nvhchain.case import load_case
    from nvhchain.report import export_craig_bampton

    case = load_case(options.case)
    made = export_craig_bampton(case, options.out, fidelity=_fidelity(options, [case]), modes_to=options.modes_to)
    print(f"{options.out}: {len(made.names)} seats, {len(made.interface_frequency)} modes")
    return 0


def _report(options: argparse.Namespace) -> int:
    from nvhchain.report import write_page

    print(write_page(options.folder))
    return 0


def _tradeoff(options: argparse.Namespace) -> int:
    from nvhchain import tradeoff
    from nvhchain.case import load_case

    case = load_case(options.case)
    out = Path(options.out or Path("out") / f"tradeoff-{case.name}")
    sweep = tradeoff.tradeoff(
        case, out=out, fidelity=PRESETS[options.fidelity], knobs=options.knob, progress=_variants, watcher=Console()
    )
    tradeoff.save_tradeoff(sweep, out)
    print(tradeoff.markdown(sweep), end="")
    return 0


def _variants(done: int, total: int) -> None:
    print(f"variant {done} of {total}", file=sys.stderr, flush=True)


def _plan(options: argparse.Namespace) -> int:
    from nvhchain.case import load_case
    from nvhchain.scene import plan

    case = load_case(options.case)
    print(plan(case, fidelity=_fidelity(options, [case])))
    return 0


def _check(options: argparse.Namespace) -> int:
    from nvhchain.advice import advice
    from nvhchain.case import GearboxCase, load_case

    case = load_case(options.case)
    print(f"{options.case}: {case.name} is valid")
    for why in advice(case) if isinstance(case, GearboxCase) else ():
        print(f"{case.name} would notice: {why}")
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from nvhchain.doctor import diagnose, diagnose_acoustics

    findings = diagnose_acoustics() if options.acoustics else diagnose()
    for finding in findings:
        mark = "ok  " if finding.ok else "FAIL"
        print(f"{mark} {finding.name}: {finding.detail}" + ("" if finding.ok else f"; {finding.remedy}"))
    return 0 if all(finding.ok for finding in findings) else 1


if __name__ == "__main__":
    sys.exit(main())
