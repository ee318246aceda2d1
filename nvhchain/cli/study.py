"""Command `study`."""

from __future__ import annotations

import argparse
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from nvhchain.cli.console import Console
from nvhchain.cli.output import show
from nvhchain.errors import InputError, counted, require
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.runtime.processes import process_pool
from nvhchain.runtime.threads import cores

if TYPE_CHECKING:
    from nvhchain.study import Study

_LEAST_SECONDS = 20.0
"""Smallest processor time (s) of the runs after the first one for which further processes save time."""


def study_command(options: argparse.Namespace) -> int:
    """Run a study, or print its plan."""
    from nvhchain.study import load_study, run_study, write_study

    path = Path(options.study)
    study, fidelity = load_study(path), PRESETS[options.fidelity]
    out = Path(options.out or Path("out") / path.stem)
    if options.plan:
        return _print_plan(study, fidelity, path, out, options.operators)
    with _executor(options, study, fidelity) as executor:
        rows = run_study(
            study,
            out=out,
            operators=options.operators,
            fidelity=fidelity,
            executor=executor,
            progress=lambda line: show(line, error=True),
            watcher=Console(),
        )
    for line in write_study(study, rows, out):
        show(line)
    show(f"{out / 'report.html'}: {len(rows)} runs")
    return 0


def _executor(options: argparse.Namespace, study: Study, fidelity: Fidelity) -> AbstractContextManager[Executor | None]:
    """Return the executor of the named workers or scheduler, or of all cores where they save time."""
    workers, scheduler = options.workers, options.scheduler
    require(workers is None or workers >= 1, f"--workers = {workers}: give 1 or more")
    if scheduler is None:
        workers = workers or _useful_workers(study, fidelity)
        return nullcontext() if workers is None else process_pool(workers)
    from nvhchain.runtime.cluster import connect

    return connect(scheduler)


def _useful_workers(study: Study, fidelity: Fidelity) -> int | None:
    """Return the number of cores if the runs after the first one take long; None for one process."""
    from nvhchain.study import costs

    if cores() == 1:
        return None
    with suppress(InputError):  # the run says what is wrong
        repeated = (step for step in costs(study, fidelity, most=3) if step.times > 1)
        if sum((step.times - 1) * step.seconds for step in repeated) >= _LEAST_SECONDS:
            return cores()
    return None


def _print_plan(study: Study, fidelity: Fidelity, path: Path, out: Path, operators: str | None) -> int:
    """Print designs, runs, time, memory and disk of every step."""
    from nvhchain.study import (
        check_disk,
        check_parameters,
        costs,
        count_designs,
        disk_bytes,
        further_runs,
        operating_points,
        remarks,
    )

    count, points, goal = count_designs(study), operating_points(study), study.goal
    check_parameters(study)
    steps, counted_points = costs(study, fidelity), counted(len(points), "operating point")
    drawn = f" with {counted(goal.draws, 'draw')} each" if goal and goal.draws else ""
    most = "up to " if study.plan in ("optimise", "gradient") else ""
    designs = counted(study.designs if goal else count, "design")
    show(f"{path.name}: {most}{designs}{drawn} at {counted_points}, {counted(count * len(points), 'run')}")
    for step in steps:
        kept = f"  {step.disk:8.3g} MB of disk" if step.disk else ""
        show(f"  {step.name:24s} {step.times:5d} x {step.seconds:6.1f} s  {step.megabytes:6.0f} MB{kept}")
    for line in remarks(study, fidelity):
        show(line)
    if more := further_runs(study):
        show(f"Up to {counted(more, 'further run')}, one value changed, for parameters without a clear effect")
    free = check_disk(study, out, steps, operators)
    show(
        f"Processor time about {sum(step.times * step.seconds for step in steps):.0f} s; memory "
        f"{max(step.megabytes for step in steps):.0f} MB a process; disk {1e-6 * disk_bytes(study, steps):.3g} MB with "
        f"the rows, {1e-9 * free:.1f} GB are free"
    )
    return 0
