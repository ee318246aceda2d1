"""Sweep of every knob alone and of the presets: measured savings and errors."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from nvhchain.case import Case, GearboxCase
from nvhchain.conventions import Progress
from nvhchain.errors import SolverError, require
from nvhchain.fidelity import REFERENCE, Fidelity
from nvhchain.files import hdf5
from nvhchain.files.result_cache import Unwatched, Watcher, code_version, fingerprint, key_in
from nvhchain.handoff import FieldPressure, PressureHistory
from nvhchain.kinds import check_fields, checked
from nvhchain.runtime.folder_lock import hold_folder
from nvhchain.tradeoff.deviation import Deviation, deviation, deviation_in_time
from nvhchain.tradeoff.extrapolation import extent
from nvhchain.tradeoff.knobs import PACKAGES, knobs_by_package, records, variants
from nvhchain.tradeoff.measure import KILLED, Cost, Ledger, Run, measured_run

_CODE = (*PACKAGES, "spectrum", "scene", "chain", "tradeoff/deviation", "tradeoff/measure", "tradeoff/worker")
"""Packages and modules on which a row depends."""

_THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables that limit the processors of a run."""


@dataclass(frozen=True)
class Measurement:
    """One row: a knob at a value, the rest at the base.

    knob: name such as `gear.slices`, or `preset`, or `base`, or `record.` with the field that sets the record's length.
    value: setting in words.
    stages: cost of every step, cached or computed.
    deviation: deviation from the base; None for a refused run and for the base.
    refused: reason for a refusal.
    """

    knob: str
    value: str
    stages: dict[str, Cost]
    deviation: Deviation | None
    refused: str | None = None

    @property
    def seconds(self) -> float:
        """Wall time (s) of a run without cached results."""
        return Run(self.stages).seconds

    @property
    def processor(self) -> float:
        """Time (s) of all processors in a run without cached results."""
        return Run(self.stages).processor

    @property
    def megabytes(self) -> float:
        """Peak memory (MB) of the largest step."""
        return Run(self.stages).megabytes


@dataclass(frozen=True)
class SweepOrigin:
    """Case and knobs that a sweep was measured with.

    identity: identity of the case (`case_identity`); None if unknown.
    extent: extent of the case (`extent`); None if unknown.
    knobs: package → knob → value at the base.
    """

    identity: str | None = None
    extent: Mapping[str, Any] | None = None
    knobs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def measured(cls, case: Case, fidelity: Fidelity) -> SweepOrigin:
        """Return the origin of a sweep of a case around a fidelity; tuples become lists, as in a file."""
        return cls(case_identity(case), extent(case), json.loads(json.dumps(knobs_by_package(fidelity))))


@dataclass(frozen=True)
class Tradeoff:
    """All rows of a sweep, the base first.

    case, base: names of the case and the fidelity.
    measurements: rows.
    provenance: code of every package, processors and threads.
    yardstick: pressure at the base; None for a run-up.
    origin: case and knobs that the sweep was measured with.
    """

    case: str
    base: str
    measurements: tuple[Measurement, ...]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    yardstick: FieldPressure | None = field(default=None, compare=False)
    origin: SweepOrigin = field(default_factory=SweepOrigin)

    def __post_init__(self) -> None:
        check_fields(self)


@checked
def tradeoff(
    case: Case,
    *,
    out: str | Path,
    fidelity: Fidelity = REFERENCE,
    knobs: Sequence[str] | None = None,
    progress: Progress | None = None,
    watcher: Watcher | None = None,
) -> Tradeoff:
    """Sweep the knobs of a fidelity one by one, and the presets; errors are those against `fidelity`.

    out: folder for these measurements only.
    knobs: names such as `gear.slices`, parts of the fidelity, or `preset`. By default all knobs that a run of `case`
    uses.
    progress: function of the numbers of finished and of all variants.
    watcher: receives the progress of the steps of each variant.

    Every run has a process of its own. A variant that the chain refuses is a row with the reason. So is a run that the
    system ends; it is repeated when the sweep resumes.

    An interrupted sweep resumes. Operators that a variant leaves unchanged are cached in `out`. Results whose cost is
    missing are removed.
    """
    require(
        "pressure" in case.quantities,
        f"{case.name} asks for {', '.join(case.quantities)}: errors are those of the sound pressure; ask for it",
    )
    out, report = hdf5.writable_folder(out, "out"), progress or (lambda done, total: None)
    with hold_folder(out):
        return _swept(case, fidelity, out, knobs, report, watcher or Unwatched())


def _swept(
    case: Case, fidelity: Fidelity, out: Path, knobs: Sequence[str] | None, report: Progress, watcher: Watcher
) -> Tradeoff:
    todo = [(knob, value, case, variant) for knob, value, variant in variants(case, fidelity, knobs)]
    todo += [(knob, value, variant, fidelity) for knob, value, variant in records(case, knobs)]
    sweep = _Sweep(case, fidelity, out, watcher)
    report(0, len(todo) + 1)
    rows = [sweep.base()]
    for done, variant in enumerate(todo):
        report(done + 1, len(todo) + 1)
        rows.append(sweep.row(*variant))
    report(len(todo) + 1, len(todo) + 1)
    return Tradeoff(
        case.name, fidelity.name, tuple(rows), _provenance(), sweep.yardstick(), SweepOrigin.measured(case, fidelity)
    )


class _Sweep:
    """Folder of a sweep: operators, results of the base, costs and rows."""

    def __init__(self, case: Case, fidelity: Fidelity, out: Path, watcher: Watcher) -> None:
        self._case, self._fidelity, self._out, self._watcher = case, fidelity, out, watcher
        self._ledger = Ledger(out / "costs.json")
        self._spine = out / f"base-{_identity(case, fidelity)[:10]}"
        if self._ledger.file.exists():
            self._remove_uncosted()
        elif not any(out.rglob("*.h5")):  # else they belong to another work
            self._ledger.begin()

    def _remove_uncosted(self) -> None:
        """Delete cached results without a cost, which remain of an interrupted sweep."""
        for folder in (self._out / "operators", self._spine):
            for file in folder.rglob("*.h5"):
                if key_in(file) not in self._ledger.costs:
                    file.unlink()

    def base(self) -> Measurement:
        """Return the row of the yardstick and keep its results."""
        run = self._run(self._case, self._fidelity, self._spine)
        if (run.refused or "").startswith(KILLED):
            raise SolverError(f"the base {self._fidelity.name} was {run.refused}: measure it again, with more memory")
        require(run.refused is None, f"the base {self._fidelity.name} is refused: {run.refused}")
        return Measurement("base", self._fidelity.name, run.stages, None)

    def yardstick(self) -> FieldPressure | None:
        """Return the base's pressure at constant speed, or None."""
        path = self._spine / "pressure.h5"
        return hdf5.load(path, FieldPressure) if path.exists() else None

    def row(self, knob: str, value: str, case: Case, fidelity: Fidelity) -> Measurement:
        """Return the row of a variant of the case or the fidelity, cached or measured now."""
        kept = self._out / "rows" / f"{fingerprint(_identity(self._case, self._fidelity), knob, value)[:16]}.json"
        identity = _identity(case, fidelity)
        with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):  # no row yet, or a damaged one
            record = json.loads(kept.read_text())
            if record["identity"] == identity:
                return measurement(record)
        made = self._measure(knob, value, case, fidelity)
        if made.refused is None or not made.refused.startswith(KILLED):
            kept.parent.mkdir(exist_ok=True)
            hdf5.write_text(kept, json.dumps({"identity": identity, **asdict(made)}))
        return made

    def _measure(self, knob: str, value: str, case: Case, fidelity: Fidelity) -> Measurement:
        spine = self._out / "variant"
        shutil.rmtree(spine, ignore_errors=True)
        spine.mkdir()
        for file in self._spine.glob("*.h5"):  # unchanged results are cache hits
            _link_or_copy(file, spine / file.name)
        try:
            run = self._run(case, fidelity, spine)
            error = None if run.refused else _deviation(self._case, spine, self._spine)
        finally:
            shutil.rmtree(spine, ignore_errors=True)
        return Measurement(knob, value, run.stages, error, run.refused)

    def _run(self, case: Case, fidelity: Fidelity, spine: Path) -> Run:
        return measured_run(
            case,
            fidelity,
            out=spine,
            operators=self._out / "operators",
            ledger=self._ledger,
            watcher=self._watcher,
        )


def _link_or_copy(file: Path, link: Path) -> None:
    """Make a hard link, or a copy on file systems without hard links."""
    try:
        os.link(file, link)
    except OSError:
        shutil.copyfile(file, link)


def _identity(case: Case, fidelity: Fidelity) -> str:
    """Hash of a run: case, its files, knobs and code, without the names of presets and the folder of the case."""
    return fingerprint(case_identity(case), knobs_by_package(fidelity), _code())


def case_identity(case: Case) -> str:
    """Hash of a case and the contents of its files, without their paths."""
    contents: list[Any] = [(Path(case.folder) / name).read_bytes() for name in _files(case)]
    if isinstance(case, GearboxCase) and (included := case.housing.included_content(case)) is not None:
        contents.append(included)
    return fingerprint(replace(case, folder=""), contents)


def _files(part: Any) -> Iterator[str]:
    """Yield the names of the files to which a part of a case refers."""
    if is_dataclass(part):
        for item in fields(part):
            value = getattr(part, item.name)
            if item.name == "file":
                yield value
            else:
                yield from _files(value)
    elif isinstance(part, tuple):
        for value in part:
            yield from _files(value)


def _code() -> dict[str, str]:
    return {package: code_version(package) for package in _CODE}


def _provenance() -> dict[str, Any]:
    return {
        "code": _code(),
        "processors": os.cpu_count(),
        "threads": {name: os.environ[name] for name in _THREADS if name in os.environ},
    }


def _deviation(case: Case, spine: Path, base: Path) -> Deviation:
    if (base / "pressure_history.h5").exists():
        histories = [hdf5.load(folder / "pressure_history.h5", PressureHistory) for folder in (spine, base)]
        return deviation_in_time(*histories)
    orders = [float(order) for order in case.mesh_orders.values()]
    pressures = [hdf5.load(folder / "pressure.h5", FieldPressure) for folder in (spine, base)]
    return deviation(pressures[0], pressures[1], orders)


def measurement(record: dict[str, Any]) -> Measurement:
    """Return a row from its JSON form, written by `dataclasses.asdict`."""
    error = record["deviation"]
    if error is not None:
        orders = {float(order): value for order, value in error["orders"].items()}
        error = Deviation(error["overall"], error["worst_line"], error["worst_frequency"], orders)
    stages = {name: Cost(**cost) for name, cost in record["stages"].items()}
    return Measurement(record["knob"], record["value"], stages, error, record["refused"])
