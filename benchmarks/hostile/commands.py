"""Commands of nvhchain on small cases, in processes that are copies of this one: nothing is imported twice."""

from __future__ import annotations

import csv
import json
import os
import re
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

ROOT = Path(__file__).parents[2]
CASES = ROOT / "cases"
TIME_LIMIT = 600.0
"""s that a command may take at most, on a machine with other work."""


@dataclass(frozen=True)
class Ended:
    """code: exit code, negative for a signal; None where the time ran out.  out, err: output."""

    code: int | None
    out: str
    err: str


class Started:
    """A command at work in a session of its own, with a working directory, a folder of temporary files and a log."""

    def __init__(self, arguments: list[str], place: Path) -> None:
        self.place, self.code = place, None
        (place / "temporary").mkdir(parents=True, exist_ok=True)
        for name in ("out.txt", "err.txt"):  # here: a signal may arrive before the copy has opened them
            (place / name).write_text("")
        sys.stdout.flush()
        sys.stderr.flush()
        self.pid = os.fork()
        if not self.pid:
            code = 99
            try:
                code = _as_command(arguments, place)
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)

    def wait(self, seconds: float) -> Ended | None:
        """How it ended, None while it is at work after so many seconds."""
        end = time.monotonic() + seconds
        while self.code is None:
            done, status = os.waitpid(self.pid, os.WNOHANG)
            if done:
                self.code = os.waitstatus_to_exitcode(status)
            elif time.monotonic() > end:
                return None
            else:
                time.sleep(0.01)
        return Ended(self.code, *((self.place / name).read_text(errors="replace") for name in ("out.txt", "err.txt")))

    def family(self) -> list[psutil.Process]:
        """Processes of its session, but for itself."""
        found = []
        for process in psutil.process_iter():
            try:
                ours = process.pid != self.pid and os.getsid(process.pid) == self.pid
                if ours and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
            except (OSError, psutil.Error):
                continue
        return found

    def end(self) -> None:
        """Kill whatever is left of it."""
        for pid in (*(process.pid for process in self.family()), *([self.pid] if self.code is None else [])):
            try:
                os.kill(pid, 9)
            except OSError:
                continue
        self.wait(10.0)


def _as_command(arguments: list[str], place: Path) -> int:
    """Be the command line in `place`."""
    from nvhchain.cli import main

    os.setsid()
    os.chdir(place)
    for number, name in ((1, "out.txt"), (2, "err.txt")):
        file = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, number)
        os.close(file)
    os.environ["TMPDIR"] = str(place / "temporary")
    import tempfile

    tempfile.tempdir = None
    try:
        return main(arguments)
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else 1
    except BaseException:
        import traceback

        traceback.print_exc()
        return 98


def load_everything() -> None:
    """Import what commands import, so that copies of this process begin with it."""
    import distributed  # noqa: F401
    import matplotlib.figure  # noqa: F401
    import scipy.signal  # noqa: F401

    import nvhchain.chain
    import nvhchain.chain.prefetch
    import nvhchain.cli
    import nvhchain.interop
    import nvhchain.plots
    import nvhchain.report
    import nvhchain.tradeoff  # noqa: F401


def finished(arguments: list[str], place: Path, seconds: float = TIME_LIMIT) -> Ended:
    """Run a command to its end, or to the limit of time."""
    command = Started(arguments, place)
    try:
        return command.wait(seconds) or Ended(None, "", "")
    finally:
        command.end()


@dataclass(frozen=True)
class Command:
    """arguments: from the folder of results.  weight: of the command among all.  after: command whose results it takes.

    children: whether it starts processes.  in_part: whether it may begin with any part of what it leaves.

    says_lost: whether what a killed child was to measure is a row of its own kind, exit code 0.
    answer: levels or errors, from the folder and the output.
    """

    arguments: Callable[[Path], list[str]]
    weight: int
    after: str | None = None
    children: bool = False
    in_part: bool = True
    says_lost: bool = False
    answer: Callable[[Path, Ended], Any] = lambda out, ended: ended.out.replace(str(out), "OUT")


def write_cases(folder: Path) -> None:
    """Cases of commands, beside the shipped ones."""
    folder.mkdir(parents=True, exist_ok=True)
    sphere, small = CASES / "sphere" / "on_floor.toml", CASES / "small" / "single_stage.toml"
    (folder / "larger.toml").write_text(
        f'base = "{sphere}"\nname = "larger"\n[body]\ntype = "sphere"\nradius_mm = 12\n'
    )
    (folder / "damped.toml").write_text(f'base = "{small}"\nname = "damped"\n[housing]\nmodal_damping = 0.04\n')
    (folder / "ramp.toml").write_text(
        f'base = "{small}"\nname = "ramp"\n[operation]\ninput_speed_rpm = 1500\n'
        "ramp = { end_speed_rpm = 1800, duration = 0.2 }\n"
    )
    (folder / "study.toml").write_text(
        f'case = "{sphere}"\n[[parameters]]\nname = "size"\npath = "body.radius_mm"\nvalues = [8, 10, 12, 14]\n'
    )


def _errors(out: Path, ended: Ended) -> list[tuple[str, str, Any]]:
    """Errors of a sweep, without its times."""
    rows = [json.loads(file.read_text()) for file in sorted((out / "rows").glob("*.json"))]
    return sorted((row["knob"], row["value"], json.dumps(_without_costs(row))) for row in rows)


def _studied(out: Path, ended: Ended) -> list[str]:
    """Rows of a study without seconds."""
    with (out / "study.csv").open(newline="", encoding="utf-8") as file:
        return sorted(json.dumps({k: v for k, v in row.items() if "second" not in k}) for row in csv.DictReader(file))


def _tabulated(out: Path, ended: Ended) -> list[tuple[str, str]]:
    return [(path.name, path.read_text(encoding="utf-8")) for path in sorted((out / "tables").glob("*.csv"))]


def _without_costs(row: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if name not in ("stages", "identity", "seconds")}


def commands(cases: Path) -> dict[str, Command]:
    """Commands by name; most tries are of those that take least."""
    sphere, small = str(CASES / "sphere" / "on_floor.toml"), str(CASES / "small" / "single_stage.toml")
    draft = ["--fidelity", "draft"]

    def into(*words: str) -> Callable[[Path], list[str]]:
        return lambda out: [*words, *draft, "--out", str(out)]

    return {
        "run, sphere": Command(into("run", sphere), 30),
        "run, gearbox": Command(into("run", small), 20, children=True),
        "run, workers": Command(into("run", sphere, "--workers", "1"), 6, children=True),
        "compare, spheres": Command(into("compare", sphere, str(cases / "larger.toml")), 12),
        "compare, gearboxes": Command(into("compare", small, str(cases / "damped.toml")), 6, children=True),
        "record": Command(into("record", str(cases / "ramp.toml")), 12, children=True),
        "contributions": Command(into("contributions", small), 6, "run, gearbox"),
        "craig-bampton": Command(
            lambda out: ["craig-bampton", small, *draft, "--modes-to", "9000", "--out", str(out / "seats.mat")],
            3,
            "run, gearbox",
        ),
        "report": Command(lambda out: ["report", str(out)], 10, "compare, spheres"),
        "plot": Command(
            lambda out: ["plot", str(out / "bearing_forces.h5"), "--out", str(out / "forces.png")], 10, "run, gearbox"
        ),
        "plot, housing": Command(
            lambda out: ["plot", *map(str, sorted(out.glob("housing-*.h5"))), "--out", str(out / "housing.png")],
            4,
            "run, gearbox",
            children=True,
        ),
        "tradeoff": Command(
            into("tradeoff", sphere, "--knob", "acoustics.quadrature_order"),
            12,
            children=True,
            in_part=False,
            says_lost=True,
            answer=_errors,
        ),
        "study": Command(into("study", str(cases / "study.toml")), 8, answer=_studied),
        "study, workers": Command(
            into("study", str(cases / "study.toml"), "--workers", "2"),
            6,
            children=True,
            says_lost=True,
            answer=_studied,
        ),
        "sound": Command(lambda out: ["sound", str(out), "--seconds", "1"], 4, "run, gearbox"),
        "tables": Command(lambda out: ["tables", str(out)], 6, "run, gearbox", answer=_tabulated),
        "modes": Command(into("modes", small), 4),
        "check": Command(lambda out: ["check", small], 4),
        "plan": Command(lambda out: ["plan", small], 4, answer=lambda out, ended: re.sub(r"\d+", "N", ended.out)),
    }
