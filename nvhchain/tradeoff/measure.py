"""Cost of every step of a run: time and memory; a cached step has the cost of its computation."""

from __future__ import annotations

import json
import pickle
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass, field
from math import inf
from pathlib import Path
from subprocess import Popen, TimeoutExpired
from typing import IO, Any

import psutil

from nvhchain.case import Case
from nvhchain.errors import FileFormatError, SolverError, require
from nvhchain.fidelity import Fidelity
from nvhchain.files.hdf5 import write_text
from nvhchain.files.result_cache import Watcher, remove_abandoned_locks
from nvhchain.runtime import processes
from nvhchain.runtime.folder_lock import temporary_folder

KILLED = "killed by signal"
"""Beginning of `Run.refused` where the system ended the run; a run with more memory may succeed."""

_PATIENCE = 5.0
"""Time (s) that a run has to end by itself."""

_SAMPLING = 0.02
"""Time (s) between two samples of the run's memory, and between two looks for its events."""


@dataclass(frozen=True)
class Cost:
    """Cost of one step.

    seconds: wall time (s).
    processor: time (s) of all processors, user and system, of the process and its children. Other work on the machine
        hardly affects it.
    megabytes: peak resident memory (MB) of the process and its children.

    Raises InputError if a value is negative or not finite.
    """

    seconds: float
    processor: float
    megabytes: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            require(0 <= value < inf, f"a stage that took {value} {name} is none: measure it again")


@dataclass
class Ledger:
    """Costs of finished steps by the cache key of their results, kept in a file.

    file: JSON file.
    costs: key → cost.

    Raises FileFormatError if the file holds something else.
    """

    file: Path
    costs: dict[str, Cost] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.file.exists():
            return
        try:
            self.costs = {key: Cost(*cost) for key, cost in json.loads(self.file.read_text()).items()}
        except (ValueError, TypeError, AttributeError) as error:
            raise FileFormatError(
                f"{self.file}: not what stages took ({error}): remove {self.file.parent} and measure again"
            ) from None

    def costs_of(self, stages: Sequence[tuple[str, str]]) -> dict[str, Cost]:
        """Return step → cost for the (step, key) pairs of a run; FileFormatError for a cached result without a cost."""
        lost = [stage for stage, key in stages if key not in self.costs]
        if lost:
            raise FileFormatError(
                f"{self.file} has no cost of {', '.join(lost)}, cached before: remove their files under "
                f"{self.file.parent} and measure again"
            )
        return {stage: self.costs[key] for stage, key in stages}

    def enter(self, key: str, cost: Cost) -> None:
        """Add a cost and write the file at once."""
        self.costs[key] = cost
        self.begin()

    def begin(self) -> None:
        """Write the file; results found beside it from now on belong to this sweep."""
        write_text(self.file, json.dumps({key: astuple(cost) for key, cost in self.costs.items()}))


@dataclass(frozen=True)
class Run:
    """Cost of a measured run.

    stages: cost of every step by its name.
    refused: reason for a missing result.
    """

    stages: dict[str, Cost]
    refused: str | None = None

    @property
    def seconds(self) -> float:
        """Wall time (s) of all steps, without cached results."""
        return sum(cost.seconds for cost in self.stages.values())

    @property
    def processor(self) -> float:
        """Time (s) of all processors and all steps, without cached results."""
        return sum(cost.processor for cost in self.stages.values())

    @property
    def megabytes(self) -> float:
        """Peak memory (MB) of the largest step."""
        return max((cost.megabytes for cost in self.stages.values()), default=0.0)


def measured_run(
    case: Case, fidelity: Fidelity, *, out: Path, operators: Path, ledger: Ledger, watcher: Watcher
) -> Run:
    """Run a case in a process of its own, with its hand-offs in `out` and `operators`; cached ones are used.

    operators: folder of the shared operators.
    ledger: costs of finished steps; new ones are added.
    Returns costs. A refusal by the chain or the system (killed for its memory) is a result, too: `Run.refused`.
    """
    for folder in (out, operators):
        folder.mkdir(parents=True, exist_ok=True)
    with (
        temporary_folder("tradeoff") as temporary,
        Path(temporary, "events").open("w+b") as events,
        tempfile.TemporaryFile() as errors,
        processes.start_python("-m", "nvhchain.tradeoff.worker", stdin=processes.PIPE, stderr=errors) as process,
    ):
        assert process.stdin is not None
        try:
            with suppress(OSError):  # it has ended already
                pickle.dump((case, fidelity, out, operators, Path(events.name)), process.stdin)
                process.stdin.flush()
            run = _followed(events, process, ledger, watcher)
        except BaseException:
            _end(process)
            raise
        finally:
            with suppress(OSError):
                process.stdin.close()  # this ends the process
            if process.wait() < 0:
                remove_abandoned_locks()
        if run is None and process.returncode < 0:
            run = Run({}, f"{KILLED} {-process.returncode}")
        if run is None:
            errors.seek(0)
            lines = errors.read().decode(errors="replace").strip().splitlines() or ["no message"]
            raise SolverError(
                f"{case.name} at {fidelity.name}: the run failed with code {process.returncode}: {lines[-1]}"
            )
    return run


def _end(process: Popen[bytes]) -> None:
    """End a run and its children; kill it if it is busy in compiled code."""
    process.terminate()
    try:
        process.wait(_PATIENCE)
    except TimeoutExpired:
        process.kill()


def _followed(events: IO[bytes], process: Popen[bytes], ledger: Ledger, watcher: Watcher) -> Run | None:
    """Follow a run until it ends; return None if no outcome arrived."""
    peak, run = 0.0, None
    for event in _events(events, process):
        peak = max(peak, resident(process.pid))
        if event is None:
            continue
        if event["event"] == "begin":
            peak = resident(process.pid)
            watcher.begin(event["stage"])
        elif event["event"] == "end":
            ledger.enter(event["key"], Cost(event["seconds"], event["processor"], peak))
            watcher.end(event["stage"], "computed")
        elif event["event"] == "refused":
            run = Run({}, event["reason"])
        else:
            run = Run(ledger.costs_of(event["stages"]))
    return run


def _events(events: IO[bytes], process: Popen[bytes]) -> Iterator[dict[str, Any] | None]:
    """Yield the events of a run from the file that takes them, and None after every interval without one.

    Windows can neither hand a further pipe to a child nor wait for one.
    """
    rest = b""
    while True:
        ended = process.poll() is not None
        piece = events.read()
        if not piece:
            if ended:
                return
            yield None
            time.sleep(_SAMPLING)
            continue
        *lines, rest = (rest + piece).split(b"\n")
        for line in lines:
            yield json.loads(line)


def resident(pid: int) -> float:
    """Return the resident memory (MB) of a process and its children; 0 for a process that has ended."""
    try:
        process = psutil.Process(pid)
        family = [process, *process.children(recursive=True)]
        return sum(member.memory_info().rss for member in family) / 1e6
    except psutil.NoSuchProcess:
        return 0.0
