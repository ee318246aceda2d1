"""Random signals to commands and to their children: levels, exit codes and leftovers.

    python -m benchmarks kills [N] [SEED] [SECONDS]

Writes docs/measured/project/kills.md: N tries (500), for SECONDS at most (no limit). A command begins in a folder that
holds a random part of what it leaves; it, or one of its children, gets SIGINT, SIGTERM or SIGKILL at a random time.
The same command then runs to its end. Exits with 1 where a try fails.
"""

from __future__ import annotations

import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from signal import SIGINT, SIGKILL, SIGTERM, Signals, default_int_handler, signal
from typing import Any

import psutil

from benchmarks.hostile.commands import Command, Ended, Started, commands, finished, load_everything, write_cases
from benchmarks.publish import publish

SIGNALS = (SIGINT, SIGTERM, SIGKILL)
PATIENCE = 10.0
"""s after the end of a command in which its processes end, too, on a machine without other work."""

CODES = {SIGINT: 130, SIGTERM: 143, SIGKILL: -SIGKILL}


@dataclass(frozen=True)
class Undisturbed:
    """seconds: of the command from nothing.  answer: levels or errors.  kept: what it leaves."""

    seconds: float
    answer: Any
    kept: Path


def undisturbed(chosen: dict[str, Command], folder: Path) -> dict[str, Undisturbed]:
    """Each command once, to its end."""
    found: dict[str, Undisturbed] = {}
    for name, command in chosen.items():
        kept = folder / name.replace(", ", "-") / "out"
        if command.after:
            shutil.copytree(found[command.after].kept, kept)
        kept.mkdir(parents=True, exist_ok=True)
        began = time.monotonic()
        ended = finished(command.arguments(kept), kept.parent)
        if ended.code != 0:
            raise SystemExit(f"{name} fails undisturbed (exit code {ended.code}): {ended.err}")
        found[name] = Undisturbed(time.monotonic() - began, command.answer(kept, ended), kept)
    return found


def patience() -> float:
    """`PATIENCE`, longer where more processes want a processor than there are."""
    return PATIENCE * max(1.0, os.getloadavg()[0] / len(os.sched_getaffinity(0)))


class Clock:
    """Times at which a command is at work: nearer where it had ended before its signal, later where it had not."""

    def __init__(self) -> None:
        self._scale: dict[tuple[str, float], float] = {}

    def delay(self, name: str, share: float, usual: float, rng: random.Random) -> float:
        return rng.random() * self._scale.setdefault((name, share), usual)

    def heed(self, name: str, share: float, *, ended: bool) -> None:
        self._scale[name, share] *= 0.4 if ended else 1.2


def attempt(
    name: str, command: Command, before: dict[str, Undisturbed], place: Path, clock: Clock, rng: random.Random
) -> tuple[str, str, list[str]]:
    """One signal; returns (signal and its receiver, how the command ended, faults)."""
    usual, out = before[name], place / "out"
    out.mkdir(parents=True)
    share = _begun_folder(before[command.after].kept if command.after else usual.kept, out, command, rng)
    signal, to_child = rng.choice(SIGNALS), command.children and rng.random() < 0.5
    delay = clock.delay(name, share, usual.seconds, rng) * (0.5 if to_child else 1.0)
    started = Started(command.arguments(out), place)
    try:
        receiver = _signal(started, signal, delay, to_child, usual.seconds)
        clock.heed(name, share, ended=receiver.startswith("nobody"))
        kind = f"{Signals(signal).name} to {receiver}"
        ended = started.wait(patience() if receiver == "the command" else 600.0)
        if ended is None:
            return kind, "does not end", [f"at work {patience():.0f} s later"]
        faults = _faults_of_end(ended, signal, receiver, usual, command, out)
        faults += _processes_left(started)
        killed = ended.code == -SIGKILL
        if not killed:
            faults += [f"leaves {path.name}" for path in _left(place)]
    finally:
        started.end()
    again = finished(command.arguments(out), place)
    if again.code != 0:
        faults.append(f"the next run ends with {again.code}: {again.err[-300:]}")
    elif command.answer(out, again) != usual.answer:
        faults.append(f"another answer: {command.answer(out, again)} for {usual.answer}")
    faults += [f"the next run leaves {path.name}" for path in _left(place)]
    return kind, str(ended.code), faults


def _begun_folder(kept: Path, out: Path, command: Command, rng: random.Random) -> float:
    """Fill `out` with a random part of what the command, or the one before it, leaves; returns the share."""
    whole = command.after is not None
    share = 1.0 if whole else rng.choice((0.0, 0.5, 0.8)) if command.in_part else 0.0
    if share:
        shutil.copytree(kept, out, dirs_exist_ok=True)
    for file in sorted(path for path in out.rglob("*") if path.is_file()):
        if rng.random() >= share:
            file.unlink()
    return share


def _signal(started: Started, signal: Signals, delay: float, to_child: bool, patience: float) -> str:
    """Send the signal after `delay` s, to a child as soon as there is one; returns who got it."""
    end = time.monotonic() + delay
    while time.monotonic() < end and started.wait(0.0) is None:
        time.sleep(0.005)
    end = time.monotonic() + patience
    while to_child and started.wait(0.0) is None and time.monotonic() < end:
        children = [child for child in started.family() if not _of_python(child)]
        if children:
            try:
                child = random.Random(len(children)).choice(children)
                child.send_signal(signal)
                return "a child"
            except psutil.Error:
                continue
        time.sleep(0.005)
    if started.wait(0.0) is not None:
        return "nobody: it had ended"
    os.kill(started.pid, signal)
    return "the command"


def _of_python(child: psutil.Process) -> bool:
    """Whether a process is the one that keeps count for `multiprocessing`: Python says so itself where it is killed."""
    try:
        return "resource_tracker" in " ".join(child.cmdline())
    except psutil.Error:
        return True


def _faults_of_end(
    ended: Ended, signal: Signals, receiver: str, usual: Undisturbed, command: Command, out: Path
) -> list[str]:
    faults = ["a traceback: " + ended.err[-1500:]] if "Traceback" in ended.err else []
    # before its first line and after its last one a command has no handler of its own
    sane = {"the command": {CODES[signal], 0, -signal}, "a child": {0, 1}}.get(receiver, {0})
    if ended.code not in sane:
        faults.append(f"exit code {ended.code}: {ended.err[-300:]}")
    if ended.code == 1 and not (ended.err.splitlines() or [""])[-1].startswith("nvhchain: "):
        faults.append(f"no line of its own: {ended.err[-300:]}")
    lost = receiver == "a child" and command.says_lost
    if ended.code == 0 and not lost and command.answer(out, ended) != usual.answer:
        faults.append(f"another answer with exit code 0: {command.answer(out, ended)} for {usual.answer}")
    return faults


def _processes_left(started: Started) -> list[str]:
    end = time.monotonic() + patience()
    while (left := started.family()) and time.monotonic() < end:
        time.sleep(0.05)
    return [f"process left: {' '.join(process.cmdline())[:200]}" for process in left if process.is_running()]


def _left(place: Path) -> list[Path]:
    """Part files and temporary ones."""
    parts = [path for path in (place / "out").rglob("*") if path.name.startswith((".nvhchain", "tmp"))]
    return [*parts, *(place / "temporary").iterdir()]


def tries(
    count: int, seed: int, folder: Path, seconds: float, chosen: list[str] | None = None
) -> list[tuple[str, str, str, list[str]]]:
    """(command, signal and receiver, end, faults) of every try."""
    load_everything()
    write_cases(folder / "cases")
    all_of_them = commands(folder / "cases")
    if chosen:
        all_of_them = {name: all_of_them[name] for name in chosen}
    before = undisturbed(all_of_them, folder / "undisturbed")
    rng, clock, found = random.Random(seed), Clock(), []
    names, weights = list(all_of_them), [command.weight for command in all_of_them.values()]
    end = time.monotonic() + seconds
    for number in range(count):
        if time.monotonic() > end:
            break
        name, place = rng.choices(names, weights)[0], folder / f"{number}"
        kind, how, faults = attempt(name, all_of_them[name], before, place, clock, random.Random(f"{seed} {number}"))
        found.append((name, kind, how, faults))
        print(number, name, kind, how, *faults, sep=" | ", file=sys.stderr, flush=True)
        if not faults:
            shutil.rmtree(place)
    return found


def page(found: list[tuple[str, str, str, list[str]]], seed: int) -> str:
    """Tries and failures by command and by signal."""
    lines = [f"{len(found)} signals, seed {seed}; {sum(bool(faults) for *_, faults in found)} tries with faults.", ""]
    for title, at in (("command", 0), ("signal", 1), ("exit code", 2)):
        lines += [f"| {title} | tries | with faults |", "|---|---:|---:|"]
        tried, failed = Counter(one[at] for one in found), Counter(one[at] for one in found if one[3])
        lines += [f"| {kind} | {tried[kind]} | {failed[kind]} |" for kind in sorted(tried)]
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    count, seed, seconds = (list(map(float, sys.argv[1:])) + [500, 1, float("inf")][len(sys.argv) - 1 :])[:3]
    signal(SIGINT, default_int_handler)  # background jobs of a script ignore it otherwise, and so would all commands
    folder = Path(tempfile.mkdtemp(prefix="nvhchain-kills-"))
    found = tries(int(count), int(seed), folder, seconds)
    publish("project/kills", page(found, int(seed)))
    if any(faults for *_, faults in found):
        sys.exit(f"faults: see {folder}")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
