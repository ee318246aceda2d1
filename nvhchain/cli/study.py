"""Command `study`."""

from __future__ import annotations

import argparse
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from nvhchain.cli.output import show
from nvhchain.errors import require
from nvhchain.fidelity import PRESETS, Fidelity
from nvhchain.runtime.processes import process_pool


def study_command(options: argparse.Namespace) -> int:
    """Run a study, or print its plan."""
    from nvhchain.study import load_study, run_study, write_study

    path = Path(options.study)
    study, fidelity = load_study(path), PRESETS[options.fidelity]
    if options.plan:
        return _print_plan(path, fidelity)
    out = Path(options.out or Path("out") / path.stem)
    with _executor(options) as executor:
        rows = run_study(
            study,
            out=out,
            operators=options.operators,
            fidelity=fidelity,
            executor=executor,
            progress=lambda line: show(line, error=True),
        )
    for line in write_study(study, rows, out):
        show(line)
    show(f"{out / 'report.html'}: {len(rows)} runs")
    return 0


def _executor(options: argparse.Namespace) -> AbstractContextManager[Executor | None]:
    """Return the executor of the named workers or scheduler, if any."""
    workers, scheduler = options.workers, options.scheduler
    require(workers is None or workers >= 1, f"--workers = {workers}: give 1 or more")
    if scheduler is None:
        return nullcontext() if workers is None else process_pool(workers)
    from nvhchain.runtime.cluster import connect

    return connect(scheduler)


def _print_plan(path: Path, fidelity: Fidelity) -> int:
    """Print designs, runs, time between shared and separate operators, and memory."""
    from nvhchain.case import load_case
    from nvhchain.scene import plan
    from nvhchain.study import check_parameters, count_designs, load_study, operating_points

    study = load_study(path)
    designs, points = count_designs(study), operating_points(study)
    check_parameters(study)
    planned = plan(load_case(study.case), fidelity=fidelity).steps
    runs, whole = designs * len(points), sum(step.seconds for step in planned)
    operators = ("mesh law", "housing", "transfer vectors")
    each = sum(step.seconds for step in planned if not step.name.startswith(operators))
    show(f"{path.name}: {designs} designs at {len(points)} operating points, {runs} runs")
    show(
        f"Processor time {whole + (runs - 1) * each:.0f} s where all share gears and housing, {runs * whole:.0f} s "
        f"where none do; memory {max(step.megabytes for step in planned):.0f} MB a process"
    )
    return 0
