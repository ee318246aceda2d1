"""Whole runs as coarse as they can be, a watcher that records their steps, and sweeps in this process."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field, replace
from io import StringIO
from pathlib import Path

from nvhchain.case import Case, GearboxCase, load_case
from nvhchain.chain import run
from nvhchain.errors import InputError
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity
from nvhchain.files.result_cache import Watcher
from nvhchain.tradeoff.measure import Cost, Ledger, Run, resident
from nvhchain.tradeoff.worker import EventWatcher, keys_of

SMALL = Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml"
"""Case file of the small single stage in a checkout of the project."""

COARSE = Fidelity(
    "coarse",
    GearFidelity(
        profile_elements=4, width_layers=3, slices=6, angles_per_mesh=16, deflections_per_doubling=2, row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    ),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.04, elements_per_turn=10),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0),
)  # fmt: skip
"""Knobs for the two gearbox configurations up to 1.2 kHz."""

TINY = Fidelity(
    "tiny",
    GearFidelity(
        profile_elements=2, width_layers=2, slices=32, angles_per_mesh=16, deflections_per_doubling=2, row_aspect=2.5,
        load_pattern_tolerance=1e-2,
    ),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.02, elements_per_turn=8),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0),
)  # fmt: skip
"""Knobs for the small single stage."""


def small_gearbox(f_max: float = 2500.0) -> GearboxCase:
    """Load the small single stage up to `f_max`, Hz; two modes of its housing lie below 2.5 kHz."""
    case = load_case(SMALL)
    assert isinstance(case, GearboxCase)
    return replace(case, band=replace(case.band, high=f_max))


@dataclass
class Record:
    """Watcher that records the steps of a run, and how each ended."""

    began: list[str] = field(default_factory=list)
    ended: list[tuple[str, str]] = field(default_factory=list)

    def begin(self, step: str) -> None:
        """Record that a step has begun."""
        self.began.append(step)

    def step(self, step: str, done: int, total: int) -> None:
        """Check the progress of a step."""
        assert 0 <= done <= total

    def end(self, step: str, outcome: str) -> None:
        """Record how a step ended."""
        self.ended.append((step, outcome))


def run_here(case: Case, fidelity: Fidelity, *, out: Path, operators: Path, ledger: Ledger, watcher: Watcher) -> Run:
    """Run a case as `nvhchain.tradeoff.measure.measured_run` does, but in this process."""

    class Listener(StringIO):
        def write(self, line: str) -> int:
            event = json.loads(line)
            if event["event"] == "begin":
                watcher.begin(event["stage"])
            else:
                ledger.enter(event["key"], Cost(event["seconds"], event["processor"], resident(os.getpid())))
                watcher.end(event["stage"], "computed")
            return len(line)

    for folder in (out, operators):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        teller = EventWatcher(Listener(), (out, operators))
        result = run(case, fidelity=fidelity, out=out, operators=operators, watcher=teller)
    except InputError as error:
        return Run({}, str(error))
    return Run(ledger.costs_of(list(keys_of(result))))
