"""Commands of the command line and their arguments."""

from __future__ import annotations

import argparse
from math import floor, inf, isfinite
from pathlib import Path
from typing import NoReturn

from nvhchain import __version__
from nvhchain.cli import commands, units
from nvhchain.cli.examples import COMMANDS, EXAMPLES
from nvhchain.cli.modes import modes_command
from nvhchain.cli.sound import add_commands as add_sound_commands
from nvhchain.cli.study import study_command
from nvhchain.fidelity import PRESETS
from nvhchain.names import printable

EXIT_CODES = {
    "0": "everything asked for was produced",
    "1": "the system refused, such as a full disk, or a solver failed",
    "2": "input that is missing or cannot be used; one line on standard error for every mistake",
    "3": "a target of a case is failed or cannot be judged, with `--enforce`",
    "130, 143, 129": "stopped by Ctrl-C, SIGTERM or the end of the terminal; finished steps are cached",
}
"""Exit code → its meaning."""


class Parser(argparse.ArgumentParser):
    """Argument parser that reports an error in one line, with exit code 2."""

    def error(self, message: str) -> NoReturn:
        """Print the error and exit."""
        self.exit(2, printable(f"{self.prog}: {message} (see {self.prog} --help)\n"))


def folder(name: str) -> str:
    """Return the name of a folder, which need not exist."""
    try:
        is_file = Path(name).exists() and not Path(name).is_dir()
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{name}: {error.strerror}: name another folder") from None
    if is_file:
        raise argparse.ArgumentTypeError(f"{name} is a file: name a folder, which need not exist")
    return name


def values_of(text: str) -> tuple[float, ...]:
    """Return the values of FIRST:LAST:STEP, or of a list with commas."""
    shape = f"{text}: write FIRST:LAST:STEP, such as 500:3000:100, or numbers with commas between them"
    try:
        if ":" not in text:
            return tuple(sorted({_finite(part) for part in text.split(",")}))
        first, last, step = (_finite(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(shape) from None
    if not (step > 0.0 and last >= first):
        raise argparse.ArgumentTypeError(f"{shape}; LAST is not below FIRST, STEP is above 0")
    count = floor((last - first) / step + 1e-9) + 1
    if count > _MOST_VALUES:
        raise argparse.ArgumentTypeError(f"{text}: {count} values are more than {_MOST_VALUES}: take a larger STEP")
    return tuple(first + step * number for number in range(count))


_MOST_VALUES = 5000


def _finite(text: str) -> float:
    value = float(text)
    if not isfinite(value):
        raise ValueError(text)
    return value


def _degrees(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = inf
    if not isfinite(value):
        raise argparse.ArgumentTypeError(f"{text}: give an angle in degrees")
    return value


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line.

    Returns parser; every command names its function in `commands`.
    """
    top = Parser(
        prog="nvhchain",
        description="Predict the sound of a gearbox. Begin with: nvhchain new gearbox mine",
        epilog="Exit codes: " + "; ".join(f"{code}: {meaning}" for code, meaning in EXIT_CODES.items()),
    )
    top.add_argument("--version", action="version", version=f"nvhchain {__version__}")
    verbs = top.add_subparsers(required=True, metavar="COMMAND")

    changes = Parser(add_help=False)
    changes.add_argument(
        "--set",
        metavar="PATH=VALUE",
        action="append",
        default=[],
        help="value that replaces the case's, such as operation.input_speed_rpm=1800 or gears.NAME.x=0.1, or a knob: "
        "fidelity.gear.slices=9 (repeatable)",
    )

    one_case, use = Parser(add_help=False), Parser(add_help=False)
    one_case.add_argument("case", metavar="CASE", help="case file (TOML)")
    use.add_argument("--use", metavar="FILE", action="append", default=[], help="supplied hand-off (HDF5) to take")

    answer = Parser(add_help=False)
    answer.add_argument("--json", action="store_true", help="print one JSON object instead of text, errors included")

    common = Parser(add_help=False, parents=[changes])
    accuracy = common.add_mutually_exclusive_group()
    accuracy.add_argument("--fidelity", choices=list(PRESETS), default="standard", help="accuracy preset")
    accuracy.add_argument(
        "--tolerance-db",
        metavar="X",
        type=float,
        help="the cheapest knobs that keep to X dB against `reference`, by measured tables",
    )

    states = Parser(add_help=False)
    states.add_argument(
        "--speeds",
        metavar="RPM",
        type=values_of,
        help="further steady speeds of the input, FIRST:LAST:STEP or a list such as 800,1500,3000",
    )
    states.add_argument(
        "--torques", metavar="NM", type=values_of, help="torques at these speeds, written in the same way"
    )

    spread = Parser(add_help=False)
    where = spread.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="spread the work over N processes of this machine; study takes one for each core where that saves time",
    )
    where.add_argument("--scheduler", metavar="ADDRESS", help="spread the work over a dask scheduler, tcp://HOST:PORT")

    enforce = Parser(add_help=False)
    enforce.add_argument(
        "--enforce", action="store_true", help="exit code 3 where a target of a case is failed or cannot be judged"
    )

    new = verbs.add_parser(
        "new",
        help="copy a commented example case to start from",
        epilog="; ".join(f"{name}: {meaning}" for name, (_, meaning) in EXAMPLES.items()),
    )
    new.add_argument("example", choices=list(EXAMPLES), help="kind of case")
    new.add_argument("folder", metavar="DIR", type=folder, help="folder of the new file")
    new.set_defaults(action=commands.new)

    imported = verbs.add_parser("import", help="make a case from a gear unit in REXS, with a page of its assumptions")
    imported.add_argument("file", metavar="FILE", help="REXS 1.0 to 2.0: XML (.rexs), JSON (.rexsj) or ZIP (.rexsz)")
    imported.add_argument("--out", metavar="DIR", type=folder, required=True, help="folder of the new case")
    imported.add_argument("--load-case", metavar="NUMBER", help="load case of the file (default: the first)")
    imported.add_argument(
        "--housing",
        choices=["casting", "rigid"],
        default="casting",
        help="a casting drawn by rule, or fixed bearing seats and bearing forces alone (default: casting)",
    )
    imported.set_defaults(action=units.import_unit)

    exported = verbs.add_parser(
        "export", parents=[one_case, changes], help="write shafts, gears, bearings and load of a case as REXS"
    )
    exported.add_argument("--out", metavar="FILE", type=Path, required=True, help="REXS 1.4 (.rexs)")
    exported.set_defaults(action=units.export_unit)

    run = verbs.add_parser(
        "run",
        parents=[one_case, common, spread, states, answer, enforce, use],
        help="compute the sound pressure of a case",
    )
    run.add_argument("--out", metavar="DIR", type=folder, help="folder for the hand-offs (default: out/<case name>)")
    run.add_argument(
        "--forces",
        metavar="FILE",
        help="bearing forces of another program (CSV, LVM, TDMS, MDF4, MAT, HDF5, UFF 58), with a TOML file beside it",
    )
    run.set_defaults(action=commands.run)

    record = verbs.add_parser(
        "record",
        parents=[common, spread, use],
        help="compute bearing forces of a run-up of any length, piece by piece",
    )
    record.add_argument("case", metavar="CASE", help="case file (TOML) whose operation has a ramp")
    record.add_argument(
        "--out", metavar="DIR", type=folder, help="folder; stopped, the same command goes on (default: out/<name>)"
    )
    record.set_defaults(action=commands.record)

    compare = verbs.add_parser(
        "compare", parents=[common, spread, states, enforce], help="compare cases: verdict, page, figures, sound"
    )
    compare.add_argument("cases", metavar="CASE", nargs="+", help="case files (TOML); the first is the base")
    compare.add_argument("--out", metavar="DIR", type=folder, default="out", help="folder for results (default: out)")
    compare.set_defaults(action=commands.compare)

    mesh = Parser(add_help=False)
    mesh.add_argument("--stage", metavar="NAME", help="stage of the case: both gears, teeth in contact marked")
    mesh.add_argument(
        "--wheel-angle", metavar="DEG", type=_degrees, default=0.0, help="angle of the stage's wheel (default: 0)"
    )

    plot = verbs.add_parser(
        "plot", parents=[mesh], help="draw hand-offs of one kind into one figure, or the gears and housing of a case"
    )
    plot.add_argument("files", metavar="FILE", nargs="+", type=Path, help="hand-offs (HDF5), or one case (TOML)")
    plot.add_argument("--gear", metavar="NAME", help="gear of the case, with its finite elements")
    plot.add_argument(
        "--fidelity", choices=list(PRESETS), default="draft", help="finite elements of a case (default: draft)"
    )
    plot.add_argument("--orders", action="store_true", help="records against order of the input, not frequency")
    plot.add_argument(
        "--quantity",
        choices=["force", "transmission_error", "mesh_deflection", "output_lag", "displacement"],
        default="force",
        help="quantity of a record of bearing forces; `displacement`: colours of a gear in place of stress",
    )
    plot.add_argument(
        "--angle", action="store_true", help="transmission errors against the angle of the input, its first turn"
    )
    plot.add_argument(
        "--at",
        metavar="HZ",
        type=float,
        nargs="+",
        default=[],
        help="modes of a housing, line of a surface velocity, lines of a directivity at points on a circle (polar)",
    )
    plot.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="figure (.png, default: beside the first file; .svg, .pdf), motion of a housing (.gif, .glb, .vtu, "
        ".vtkhdf, .unv, .csv), or a gear for ParaView (.vtu)",
    )
    plot.set_defaults(action=commands.plot)

    field = verbs.add_parser(
        "gear-field",
        parents=[one_case, common, mesh],
        help="compute displacement and stress of a loaded gear at one angle",
    )
    field.add_argument("--gear", metavar="NAME", required=True, help="gear of the case")
    field.add_argument("--out", metavar="FILE", type=Path, required=True, help="hand-off (HDF5), for `plot`")
    field.set_defaults(action=commands.gear_field)

    modes = verbs.add_parser(
        "modes",
        parents=[changes, answer],
        help="find natural frequencies of shafts, meshes, bearings and housing under load",
    )
    modes.add_argument("case", metavar="CASE", help="case file (TOML) of a gearbox")
    modes.add_argument("--fidelity", choices=list(PRESETS), default="standard", help="accuracy preset")
    modes.add_argument("--highest", metavar="HZ", type=float, help="highest frequency (default: that of the band)")
    modes.add_argument("--undamped", action="store_true", help="exclude all damping")
    modes.add_argument("--out", metavar="DIR", type=folder, help="folder of the run (default: out/<case name>)")
    modes.set_defaults(action=modes_command)

    parts = verbs.add_parser(
        "contributions",
        parents=[one_case, common, use],
        help="find the contributions of paths, modes and panels to the sound",
    )
    parts.add_argument("--at", metavar="HZ", type=float, help="line of the bars (default: the loudest)")
    parts.add_argument("--order", metavar="K", type=float, help="order of a run-up (default: the loudest)")
    parts.add_argument(
        "--out", metavar="DIR", type=folder, help="folder of the run and its tables (default: out/<case name>)"
    )
    parts.set_defaults(action=commands.contributions)

    exchange = verbs.add_parser(
        "craig-bampton",
        parents=[one_case, common],
        help="write the housing's mass and stiffness at its seats for other programs",
    )
    exchange.add_argument(
        "--modes-to", metavar="HZ", type=float, required=True, help="modes with held seats up to here: 4 times the band"
    )
    exchange.add_argument("--out", metavar="FILE", type=Path, required=True, help="MATLAB .mat or Nastran .bdf (DMIG)")
    exchange.set_defaults(action=commands.craig_bampton)

    report = verbs.add_parser("report", help="write the page (HTML) of the results in a folder")
    report.add_argument("folder", metavar="DIR")
    report.add_argument(
        "--surface-pressure",
        metavar="LINES",
        type=int,
        nargs="?",
        const=6,
        help="solve the sound pressure on the housing at its loudest lines (default: 6) and colour it on the page",
    )
    report.set_defaults(action=commands.report)
    add_sound_commands(verbs)

    tables = verbs.add_parser("tables", parents=[answer], help="write all tables and curves of a run: CSV or Excel")
    tables.add_argument("folder", metavar="DIR", help="folder of `run` or `compare`")
    tables.add_argument("--out", metavar="PATH", help="workbook (.xlsx), or folder of CSV files (default: DIR/tables)")
    tables.set_defaults(action=commands.tables)

    tradeoff = verbs.add_parser(
        "tradeoff", parents=[one_case, changes, answer], help="measure error and time of each knob of the fidelity"
    )
    tradeoff.add_argument(
        "--fidelity", choices=list(PRESETS), default="reference", help="the yardstick, from which knobs are turned"
    )
    tradeoff.add_argument(
        "--knob",
        metavar="NAME",
        action="append",
        help="a knob (gear.slices), a stage, `preset` or `record` (default: all)",
    )
    tradeoff.add_argument(
        "--out", metavar="DIR", type=folder, help="folder for the measurements (default: out/tradeoff-<case name>)"
    )
    tradeoff.set_defaults(action=commands.tradeoff)

    study = verbs.add_parser(
        "study", parents=[spread], help="run many designs of one case: page, effects, best designs"
    )
    study.add_argument("study", metavar="STUDY", help="TOML file: base case, parameters, plan")
    study.add_argument("--fidelity", choices=list(PRESETS), default="draft", help="accuracy preset (default: draft)")
    study.add_argument(
        "--out", metavar="DIR", type=folder, help="folder for page and tables (default: out/<study file>)"
    )
    study.add_argument(
        "--operators", metavar="DIR", type=folder, help="folder of shared operators, such as that of another study"
    )
    study.add_argument("--plan", action="store_true", help="print designs, time and memory; compute nothing")
    study.set_defaults(action=study_command)

    plan = verbs.add_parser(
        "plan", parents=[one_case, common, answer], help="list modelled and skipped effects, seconds and memory"
    )
    plan.add_argument(
        "--out",
        metavar="DIR",
        type=folder,
        help="folder of `run` or `compare`, for cached results (default: as theirs)",
    )
    plan.set_defaults(action=commands.plan)

    check = verbs.add_parser("check", parents=[one_case, changes, answer], help="read and validate a case")
    check.set_defaults(action=commands.check)

    schema = verbs.add_parser("schema", help="print the JSON Schema of case files, for editors")
    schema.add_argument("--out", metavar="FILE", type=Path, help="file to write instead")
    schema.set_defaults(action=commands.schema)

    doctor = verbs.add_parser("doctor", parents=[answer], help="check packages and system libraries of this machine")
    doctor.add_argument("--acoustics", action="store_true", help="compare the boundary element engines on a small body")
    doctor.set_defaults(action=commands.doctor)
    completion = verbs.add_parser("completion", help="print the script that completes commands in a shell")
    completion.add_argument("shell", choices=["bash", "zsh", "tcsh"], help="shell of the script")
    completion.set_defaults(action=commands.completion, parser=top)

    for name, verb in verbs.choices.items():
        verb.epilog = f"Example: {COMMANDS[name]}" + (f". {verb.epilog}" if verb.epilog else "")
        verb.add_argument("-v", "--verbose", action="count", default=0, help="log steps on stderr; -vv: details")
        verb.add_argument("--log-file", metavar="FILE", type=Path, help="file for the log, with all details")
    return top
