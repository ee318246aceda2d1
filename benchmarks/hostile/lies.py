"""Damaged cases, files and hand-offs, and full disks: each is right, or refused in one line.

    python -m benchmarks lies [N] [SEED] [SECONDS]

Writes docs/measured/project/lies.md: N cases (5000) and N files, 2 N / 5 hand-offs with a bit turned, N / 50 parts in
STEP, N / 50 runs on a disk that is full, each kind for SECONDS at most (no limit). Exits with 1 where one is a
traceback, a wrong answer, more than one line, or takes too long.
"""

from __future__ import annotations

import io
import json
import os
import random
import re
import resource
import select
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass, fields, is_dataclass
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.hostile import valid_files
from benchmarks.hostile.commands import CASES, finished, load_everything
from benchmarks.hostile.damage import changed_case, changed_summary, damaged, with_bit_turned
from benchmarks.publish import publish
from nvhchain import DRAFT, levels
from nvhchain.case import RadiatorCase, Sphere, load_case
from nvhchain.cli import main as command_line
from nvhchain.errors import AccuracyWarning, InputError, SolverError
from nvhchain.files import hdf5
from nvhchain.scene import plan

TIME_LIMIT = 120.0
"""s for one damaged file or case, on a machine with other work."""

LONGEST = 1500
"""Characters of one line: eight mistakes, with the fields that are known."""

AFFORDABLE = 3.0
"""Foreseen processor seconds of a case that is run."""

Judge = Callable[[int], str]
"""From the number of a try to how it ended; a fault begins with FAULT."""

FAULT = "fault: "


@dataclass(frozen=True)
class Outcome:
    """kind: of damage.  tried, with what endings; faults: number of the try and words.  growth: MB in one process."""

    kind: str
    endings: dict[str, int]
    faults: list[str]
    growth: float

    @property
    def tried(self) -> int:
        return sum(self.endings.values())


def judged(kind: str, count: int, judge: Judge, *, seconds: float = float("inf"), limit: float = TIME_LIMIT) -> Outcome:
    """Judge tries 0…count−1 in copies of this process; one that crashes or hangs is a fault, and the next goes on."""
    endings, faults, growth, number = Counter[str](), list[str](), 0.0, 0
    end = time.monotonic() + seconds
    while number < count and time.monotonic() < end:
        reader, writer = os.pipe()
        pid = os.fork()
        if not pid:
            os.close(reader)
            _judge_on(range(number, count), judge, writer, end)
        os.close(writer)
        for ending, megabytes in _told(reader, limit):
            growth = max(growth, megabytes)
            endings[ending.split(":")[0]] += 1
            if ending.startswith(FAULT):
                faults.append(f"{kind} {number}: {ending.removeprefix(FAULT)}")
            number += 1
        os.close(reader)
        hangs = os.waitpid(pid, os.WNOHANG)[0] == 0
        if hangs:
            time.sleep(0.5)
            hangs = os.waitpid(pid, os.WNOHANG)[0] == 0
        if hangs:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
        if number < count and time.monotonic() < end:
            faults.append(f"{kind} {number}: {'takes more than ' + str(limit) + ' s' if hangs else 'ends the process'}")
            endings["fault"] += 1
            number += 1
    return Outcome(kind, dict(endings), faults, growth)


def _judge_on(numbers: Sequence[int], judge: Judge, writer: int, end: float) -> None:
    """Be the process of the tries; a line of JSON on `writer` for each."""
    process, base, warm = psutil.Process(), 0.0, min(50, len(numbers) // 2)
    for done, number in enumerate(numbers):
        if time.monotonic() > end:
            break
        try:
            ending = judge(number)
        except BaseException:
            ending = FAULT + traceback.format_exc()[-1500:]
        resident = process.memory_info().rss / 1e6
        base = resident if done <= warm else base
        os.write(writer, json.dumps([ending[:3000], resident - base]).encode() + b"\n")
    os._exit(0)


def _told(reader: int, limit: float) -> Iterator[tuple[str, float]]:
    """Endings from a process, until it ends or is silent for too long."""
    rest = b""
    while select.select([reader], [], [], limit)[0]:
        piece = os.read(reader, 1 << 16)
        if not piece:
            return
        *lines, rest = (rest + piece).split(b"\n")
        for line in lines:
            yield tuple(json.loads(line))


def _called(call: Callable[[], Any]) -> tuple[Any, str]:
    """Result and "", or None and how it was refused, or the fault."""
    said = io.StringIO()
    try:
        with warnings.catch_warnings(), redirect_stdout(said), redirect_stderr(said):
            warnings.simplefilter("ignore", AccuracyWarning)  # a damaged file may still be read, and coarse
            found = call()
    except (InputError, SolverError) as error:
        return None, one_line(str(error))
    if said.getvalue():
        return None, FAULT + "prints " + said.getvalue()[:300]
    return found, ""


def one_line(text: str) -> str:
    """Return "refused", or what is wrong with the words of a refusal."""
    if not text.isprintable():
        return FAULT + f"not one printable line: {text!r}"
    if not 10 < len(text) < LONGEST:
        return FAULT + f"{len(text)} characters: {text[:300]}"
    return "refused"


def unsound(value: Any, name: str = "value") -> str:
    """Name of an array within a result that is not finite, or of an index that leads nowhere."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "fc" and not np.isfinite(value).all():
        return name
    if is_dataclass(value):
        nodes = getattr(value, "points", getattr(value, "nodes", None))
        if hasattr(value, "cells") and isinstance(nodes, np.ndarray):
            for _, cell in value.cells:
                if not ((cell >= 0) & (cell < len(nodes))).all():
                    return f"{name}.cells"
        parts = ((field.name, getattr(value, field.name)) for field in fields(value))
        return next((found for part, inner in parts if (found := unsound(inner, f"{name}.{part}"))), "")
    if isinstance(value, tuple | list):
        return next((found for inner in value if (found := unsound(inner, name))), "")
    return ""


def files(folder: Path, count: int, seed: int, seconds: float) -> Outcome:
    """Damaged files of every format but hand-offs."""
    folder.mkdir(parents=True)
    readers = valid_files.write_others(folder)
    valid_files.write_meshes(folder)
    readers |= {p.name: valid_files.mesh_reader(p.name) for p in folder.iterdir() if p.name not in readers}
    whole = {name: (folder / name).read_bytes() for name in sorted(readers)}
    for name, read in readers.items():
        if fault := unsound(read(folder / name)):
            raise SystemExit(f"{name} is unsound undamaged: {fault}")
    broken = folder / "broken"
    broken.mkdir()
    names = [name for name in whole if not name.endswith(".med")] * 4 + ["a.med"]  # which takes a process

    def judge(number: int) -> str:
        rng = random.Random(f"{seed} file {number}")
        name = rng.choice(names)
        path = broken / name
        path.write_bytes(damaged(whole[name], rng))
        found, refused = _called(lambda: readers[name](path))
        if refused:
            return refused if refused == "refused" else f"{refused} [{name}]"
        return f"{FAULT}{name}: {fault} is unsound" if (fault := unsound(found)) else "read"

    return judged("files", count, judge, seconds=seconds)


def bits(folder: Path, count: int, seed: int, seconds: float) -> Outcome:
    """Stored hand-offs with one bit turned: never read, for `nvhchain` itself or for the next run."""
    folder.mkdir(parents=True)
    valid_files.write_hand_offs(folder)
    whole = {path.name: path.read_bytes() for path in sorted(folder.glob("*.h5"))}

    def judge(number: int) -> str:
        rng = random.Random(f"{seed} bit {number}")
        name = rng.choice(list(whole))
        path = folder / "broken.h5"
        path.write_bytes(with_bit_turned(whole[name], rng.randrange(len(whole[name])), rng))
        found, refused = _called(lambda: hdf5.load(path))
        return refused or f"{FAULT}{name} with a bit turned is read as {type(found).__name__}"

    return judged("bits of hand-offs", count, judge, seconds=seconds)


def summaries(folder: Path, count: int, seed: int, seconds: float) -> Outcome:
    """Damaged summaries: `report` makes a page or ends in one line."""
    folder.mkdir(parents=True)
    path = valid_files.write_summary(folder)
    whole = path.read_bytes()

    def judge(number: int) -> str:
        rng = random.Random(f"{seed} summary {number}")
        path.write_bytes(damaged(whole, rng) if number % 2 else changed_summary(whole.decode(), rng).encode())
        return _commanded("report", str(folder))

    return judged("summaries", count, judge, seconds=seconds)


_PROGRESS = re.compile(r"[^:]+:|  [\w-]+( …|: cached|: computed in [\d.]+ s)")
"""Lines of a case and of its steps, which precede an error."""


def _commanded(*arguments: str) -> str:
    """How a command of the command line ended."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = command_line(arguments)
    lines = [line for line in err.getvalue().splitlines() if not _PROGRESS.fullmatch(line)]
    if code == 0:
        return "accepted"
    if code not in (1, 2) or not lines or not all(line.startswith("nvhchain: ") for line in lines):
        return f"{FAULT}exit code {code}: {err.getvalue()[:500]}"
    return next((end for end in map(one_line, lines) if end.startswith(FAULT)), one_line(lines[-1]))


EVERYTHING = """base = "single_stage.toml"
name = "everything"

[options]
friction = "auto"
flexible_shafts = true
gyroscopic = false

[[gears]]
name = "pinion"
deviations = { tolerance_class = 5, seed = 4, run_out_um = 12, ghosts = [{ order = 61, amplitude_um = 0.3 }] }

[[stages]]
name = "stage"
tolerances = { misalignment = { in_plane_mrad = 0.1, normal_mrad = 0.2 }, seed = 1 }

[spread]
bearing_stiffness = 1.5
friction = 1.4

[background]
type = "background_levels"
frequency = [100, 1000, 8000]
level = [50, 45, 20]

[[targets]]
name = "at one metre"
level = [70, 74]
input_speed_rpm = [1000, 3000]
confidence = 0.9
"""
"""Fields of what a case may state beside its parts."""


def cases(folder: Path, count: int, seed: int, seconds: float) -> Outcome:
    """Changed cases: `check` accepts or refuses them; of a sphere that is accepted the level is that of theory."""
    folder.mkdir(parents=True)
    spheres = [CASES / "sphere" / "pulsating.toml", CASES / "sphere" / "on_floor.toml"]
    small = [CASES / "small" / f"{name}.toml" for name in ("single_stage", "catalogue_bearings", "class_6", "rattle")]
    others = [*small, CASES / "gearbox" / "slotted.toml"]
    texts = {path.name: path.read_text(encoding="utf-8") for path in spheres + others}
    texts["everything.toml"] = EVERYTHING
    names = [*texts, "pulsating.toml", "pulsating.toml", "single_stage.toml", "everything.toml"]
    for name in texts:
        (folder / name).write_text(texts[name], encoding="utf-8")
    for base in CASES.glob("gearbox/*"):
        if base.is_file():
            (folder / base.name).write_bytes(base.read_bytes())

    def judge(number: int) -> str:
        rng = random.Random(f"{seed} case {number}")
        name = rng.choice(names)
        path = folder / "changed.toml"
        path.write_text(changed_case(texts[name], rng), encoding="utf-8", errors="surrogateescape")
        ending = _commanded("check", str(path))
        if ending != "accepted" or name not in ("pulsating.toml", "on_floor.toml"):
            return ending if not ending.startswith(FAULT) else f"{ending} [{name}]"
        return run_of_sphere(path)

    return judged("cases", count, judge, seconds=seconds)


def parts(folder: Path, count: int, seed: int, seconds: float) -> Outcome:
    """Damaged STEP files and changed cases of them: `check` reads the part in a process of its own."""
    folder.mkdir(parents=True)
    for name in ("cad.toml", "single_stage.toml", "gear_case.step"):
        (folder / name).write_bytes((CASES / "small" / name).read_bytes())
    step, case = ((folder / name).read_bytes() for name in ("gear_case.step", "cad.toml"))

    def judge(number: int) -> str:
        rng = random.Random(f"{seed} part {number}")
        (folder / "gear_case.step").write_bytes(damaged(step, rng) if number % 2 else step)
        text = case.decode() if number % 2 else changed_case(case.decode(), rng)
        (folder / "cad.toml").write_text(text, encoding="utf-8", errors="surrogateescape")
        return _commanded("check", str(folder / "cad.toml"))

    return judged("parts in STEP", count, judge, seconds=seconds)


def run_of_sphere(path: Path) -> str:
    """Run an accepted case of a sphere; its levels are held against theory where there is one."""
    from nvhchain import chain

    case = load_case(path)
    foreseen, refused = _called(lambda: plan(case, fidelity=DRAFT))
    if refused:
        return refused
    if foreseen.seconds > AFFORDABLE or "pressure" not in case.quantities:
        return "accepted"
    result, refused = _called(lambda: chain.run(case, fidelity=DRAFT))
    if refused:
        return refused
    if not np.isfinite(result.pressure.pressure).all():
        return FAULT + "the pressure is not finite"
    theory = of_theory(case)
    if theory is None:
        return "run"
    level = levels.overall(result.pressure.frequency, theory)
    below, above = np.array(result.error_band.overall, dtype=float).T
    if not ((below - 0.05 <= level) & (level <= above + 0.05)).all():
        return f"{FAULT}{result.overall} dB(A), limits {below} … {above}, theory {level}: {path.read_text()}"
    return "right"


def of_theory(case: Any) -> np.ndarray | None:
    """Pressure (n_f, n_point) of a sphere that pulsates in a free field; None of others."""
    free = isinstance(case, RadiatorCase) and isinstance(case.body, Sphere) and case.reflecting_plane is None
    if not free or any(case.velocity):
        return None
    k = 2 * pi * np.array(case.frequencies)[:, None] / case.air.speed_of_sound
    a, impedance = case.body.radius, case.air.density * case.air.speed_of_sound
    r = np.linalg.norm(np.array([point.position for point in case.field_points]) - case.body.centre, axis=1)
    return impedance * case.pulsation * 1j * k * a**2 / (r * (1 + 1j * k * a)) * np.exp(-1j * k * (r - a))


def full_disks(folder: Path, count: int, seed: int, seconds: float) -> Outcome:
    """Runs of a sphere that may write files of so many bytes only; the next run, with room, is right."""
    folder.mkdir(parents=True)
    arguments = ["run", str(CASES / "sphere" / "on_floor.toml"), "--fidelity", "draft", "--out", str(folder / "out")]
    usual = finished(arguments, folder)
    sizes = [path.stat().st_size for path in (folder / "out").rglob("*") if path.is_file()]

    def judge(number: int) -> str:
        rng = random.Random(f"{seed} disk {number}")
        for path in (folder / "out").rglob("*"):
            path.unlink()
        room = rng.randrange(max(sizes)) if rng.random() < 0.5 else int(rng.choice(sizes) * rng.uniform(0.9, 1.1))
        hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        try:
            ending = _commanded(*arguments)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
        left = [path.name for path in (folder / "out").rglob(".nvhchain*")]
        if left or ending.startswith(FAULT):
            return ending if ending.startswith(FAULT) else f"{FAULT}{left} left with {room} bytes"
        out = io.StringIO()
        with redirect_stdout(out), redirect_stderr(io.StringIO()):
            command_line(arguments)
        return ending if out.getvalue() == usual.out else f"{FAULT}{room} bytes: then {out.getvalue()} for {usual.out}"

    return judged("files limited in size", count, judge, seconds=seconds)


def small_file_systems(folder: Path, count: int, seed: int, seconds: float) -> Outcome | None:
    """As `full_disks`, on a file system in memory of so many bytes; None where mounting is not allowed."""
    import subprocess

    folder.mkdir(parents=True)
    arguments = ["run", str(CASES / "sphere" / "on_floor.toml"), "--fidelity", "draft", "--out", str(folder / "out")]
    usual = finished(arguments, folder)
    whole = sum(path.stat().st_size for path in (folder / "out").rglob("*") if path.is_file())
    place = folder / "small"
    place.mkdir()
    arguments[-1] = str(place / "out")

    def mounted(kilobytes: int) -> bool:
        command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "nvhchain-lies", str(place)]
        with suppress(OSError):
            return subprocess.run(command, capture_output=True, check=False).returncode == 0
        return False

    def unmount() -> None:
        subprocess.run(["umount", str(place)], capture_output=True, check=False)

    if not mounted(64):
        return None
    unmount()

    def judge(number: int) -> str:
        room = random.Random(f"{seed} system {number}").randrange(8, max(16, 2 * whole // 1024))
        mounted(room)
        try:
            ending = _commanded(*arguments)
            subprocess.run(["mount", "-o", "remount,size=64m", str(place)], check=True)
            if list(place.rglob(".nvhchain*")):
                return f"{FAULT}{list(place.rglob('.nvhchain*'))} left with {room} kB"
            out = io.StringIO()
            with redirect_stdout(out), redirect_stderr(io.StringIO()):
                command_line(arguments)
        finally:
            unmount()
        if ending.startswith(FAULT):
            return ending
        said = out.getvalue().replace(str(place), str(folder))
        return ending if said == usual.out else f"{FAULT}{room} kB: then {said} for {usual.out}"

    try:
        return judged("full file systems", count, judge, seconds=seconds)
    finally:
        unmount()


def all_lies(folder: Path, count: int, seed: int, seconds: float) -> list[Outcome]:
    """Every kind."""
    load_everything()
    found = [
        files(folder / "files", count, seed, seconds),
        bits(folder / "bits", 2 * count // 5, seed, seconds),
        summaries(folder / "summaries", count // 20, seed, seconds),
        cases(folder / "cases", count, seed, seconds),
        parts(folder / "parts", count // 50, seed, seconds),
        full_disks(folder / "disks", count // 50, seed, seconds),
        small_file_systems(folder / "systems", count // 50, seed, seconds),
    ]
    return [outcome for outcome in found if outcome is not None]


def page(found: Sequence[Outcome], seed: int) -> str:
    """Tries, how they ended, faults and growth by kind."""
    lines = [
        f"Seed {seed}. Refused: in one line. Right: within the limits that the run states of the closed form.",
        "",
        "| kind | tried | endings | faults | growth of the process / MB |",
        "|---|---:|---|---:|---:|",
    ]
    for one in found:
        endings = ", ".join(f"{count} {name}" for name, count in sorted(one.endings.items()) if name != "fault")
        lines.append(f"| {one.kind} | {one.tried} | {endings} | {len(one.faults)} | {one.growth:.0f} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    given = list(map(float, sys.argv[1:]))
    count, seed, seconds = given + [5000, 1, float("inf")][len(given) :]
    with tempfile.TemporaryDirectory(prefix="nvhchain-lies-") as folder:
        found = all_lies(Path(folder), int(count), int(seed), seconds)
    for outcome in found:
        print(*outcome.faults, sep="\n", file=sys.stderr)
    publish("project/lies", page(found, int(seed)))
    sys.exit(any(outcome.faults for outcome in found))


if __name__ == "__main__":
    main()
