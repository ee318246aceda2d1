"""Stored results of a folder: summaries, cases and hand-offs, as far as a run has come."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from nvhchain import levels
from nvhchain.errors import InputError, require
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.files import hdf5
from nvhchain.handoff import FieldPressure, FloatArray, HandOff, PressureHistory, ReducedHousing
from nvhchain.levels import place_text
from nvhchain.names import check_names
from nvhchain.plots.marks import OrderMarks, joined_orders, order_name
from nvhchain.report.run_up import Curve, curves_of, run_up_maps, sample_rate
from nvhchain.scene.kept import ESTIMATES
from nvhchain.spectrum import Waterfall

H = TypeVar("H", bound=HandOff)
T = TypeVar("T")

TRADEOFF = "tradeoff.json"
"""Name of the file of a sweep."""

_SHARED = "operators"
"""Folder of hand-offs that the runs of a comparison share."""


SAME_LEVEL = 0.01
"""Largest difference (dB) of equal levels."""


@dataclass(frozen=True, eq=False)
class StoredRun:
    """Results of one configuration: the folder of its hand-offs, its part of summary.json, and case.json.

    `summary` is empty before the end of a run, `case` for results of earlier versions.
    """

    name: str
    folder: Path
    summary: Mapping[str, Any]
    case: Mapping[str, Any]
    _loaded: dict[str, Any] = field(default_factory=dict, repr=False)

    def hand_off(self, name: str, kind: type[H]) -> H | None:
        """Return the hand-off of a step, or None where the run has not come so far or does not need it.

        InputError for a file that is not the one of the run.
        """
        path = self.folder / f"{name}.h5"
        if name not in self._loaded:
            hashes = self.summary.get("hand_offs", {})
            stated = hashes.get(name)
            made = stated is not None or name not in hashes
            found = hdf5.load(path, kind) if made and path.is_file() else None
            require(
                found is None or stated in (None, found.content_hash),
                f"{path} is not of the run or comparison that summary.json describes: repeat that one, or put its own "
                "file back",
            )
            self._loaded[name] = found
        return cast("H | None", self._loaded[name])

    @cached_property
    def pressure(self) -> FieldPressure | None:
        """Sound pressure at constant speed."""
        return self.hand_off("pressure", FieldPressure)

    @cached_property
    def pressure_history(self) -> PressureHistory | None:
        """Sound pressure of a run-up."""
        return self.hand_off("pressure_history", PressureHistory)

    @property
    def weighted_lines(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies (n_f,) Hz > 0 of the lines, and their A-weighted levels (n_f,) dB(A) at the first field point."""
        assert self.pressure is not None
        heard = self.pressure.frequency > 0
        frequency = self.pressure.frequency[heard]
        return frequency, levels.decibel(self.pressure.pressure[heard, 0]) + levels.a_weighting(frequency)

    def record(self, name: str) -> dict[str, Any]:
        """Return the object in a JSON file of the run; empty without one."""
        return json_table(self.folder / name)

    @property
    def acoustics(self) -> AcousticsFidelity:
        """Knobs of the acoustics of the run; those of `standard` in a folder that no command has written."""
        recorded = self.case.get("acoustics", {})
        stated: dict[str, Any] = {
            key: tuple(setting) if isinstance(setting, list) else setting for key, setting in recorded.items()
        }
        try:
            return AcousticsFidelity(**stated) if stated else STANDARD.acoustics
        except (TypeError, InputError):  # knobs of another version
            return STANDARD.acoustics

    @property
    def points(self) -> list[str]:
        """Names of the field points; numbers where the case is not stored."""
        named = self.case.get("field_points") or self.summary.get("points") or []
        return [str(point["name"]) for point in named]

    def point_name(self, index: int) -> str:
        """Return the name of a field point."""
        return self.points[index] if index < len(self.points) else f"field point {index + 1}"


@dataclass(frozen=True, eq=False)
class Stored:
    """Results in the folder of a page; the first run is the base, `summary` is empty before the end of a run.

    `operators` is the folder of hand-offs that runs of a comparison share, by default that in the folder.
    """

    folder: Path
    summary: Mapping[str, Any]
    runs: tuple[StoredRun, ...]
    operators: Path | None = None
    _radiating: dict[tuple[str, str], list[Any]] = field(default_factory=dict, repr=False)
    _loaded: dict[str, ReducedHousing] = field(default_factory=dict, repr=False)

    @property
    def finished(self) -> bool:
        """True where the run or comparison has written its summary."""
        return bool(self.summary)

    @cached_property
    def marks(self) -> OrderMarks:
        """Mesh orders and slot sidebands of all configurations."""
        parts = [(run.name, run.case or run.summary) for run in self.runs]
        mesh, slots = joined_orders(
            (name, record.get("mesh_orders") or {}, record.get("slot_orders") or {}) for name, record in parts
        )
        return OrderMarks(mesh=mesh, slots=slots)

    def origin(self, order: float) -> str:
        """Return the mesh that makes an order of the input; empty where none does."""
        return order_name(order, self.marks.mesh, self.marks.slots)

    def having(self, get: Callable[[StoredRun], T | None]) -> list[tuple[int, StoredRun, T]]:
        """Return number and run of all configurations for which `get` finds something, with what it finds."""
        return [(number, run, found) for number, run in enumerate(self.runs) if (found := get(run))]

    @cached_property
    def run_up_maps(self) -> dict[str, tuple[Waterfall, Waterfall]]:
        """Configuration → waterfalls of its run-up at the first field point, against frequency and against order."""
        heard = {run.name: history for run in self.runs if (history := run.pressure_history) is not None}
        high = max((float(run.case.get("values", {}).get("band.high", 0.0)) for run in self.runs), default=0.0)
        high = high or min(map(sample_rate, heard.values()), default=0.0) / 2.56
        return run_up_maps(heard, self.marks, high=high)

    @cached_property
    def curves(self) -> dict[str, list[Curve]]:
        """Configuration → curves over the speed of its run-up: the overall level, then the main orders."""
        return curves_of(self.run_up_maps, self.marks)

    @cached_property
    def compared_by_order(self) -> bool:
        """True if the steady runs have different input speeds: their lines correspond by order, not by frequency."""
        speeds = {
            round(pressure.input_speed, 6) if (pressure := run.pressure) is not None else 0.0 for run in self.runs
        }
        return len(speeds) > 1 and min(speeds) > 0

    def line_scale(self, run: StoredRun) -> float:
        """Return what multiplies the number of a line to its frequency (Hz) in a run: 1, or turns per second."""
        return run.pressure.input_speed / (2 * np.pi) if self.compared_by_order and run.pressure is not None else 1.0

    @property
    def microphone(self) -> str:
        """Name and position of the field point that levels refer to; empty without one."""
        point = self.summary.get("field_point")
        if not point:
            return self.runs[0].point_name(0) if self.runs[0].points else ""
        position = point["position_m"]
        return f"{point['name']}, at {place_text(position) if isinstance(position, list) else f'({position})'} m"

    @property
    def hand_off_files(self) -> list[Path]:
        """All hand-offs of the runs and their shared operators."""
        folders = dict.fromkeys([*(run.folder for run in self.runs), self.operators or self.folder / _SHARED])
        return [path for folder in folders for path in sorted(folder.glob("*.h5"))]

    def housing(self, run: StoredRun) -> ReducedHousing | None:
        """Return the housing that the summary of a run names, or the only one there is; None without one."""
        own = sorted(run.folder.glob("housing*.h5"))
        every = own or [path for path in self.hand_off_files if path.name.startswith("housing")]
        named = run.summary.get("housing")
        if len(every) > 1 and not named:
            return None
        for path in map(str, every):
            if path not in self._loaded:
                self._loaded[path] = hdf5.load(path, ReducedHousing)
        found = (self._loaded[str(path)] for path in every)
        return next((housing for housing in found if len(every) == 1 or housing.content_hash == named), None)

    def radiating(self, kind: type[H], surface: str) -> list[H]:
        """Return the hand-offs of a kind on a surface, by its content hash; each file is read once."""
        key = (kind.__name__, surface)
        if key not in self._radiating:
            found = [hdf5.load(path, kind) for path in self.hand_off_files if hdf5.record(path)[0] == kind.__name__]
            self._radiating[key] = [hand_off for hand_off in found if hand_off.surface.content_hash == surface]  # type: ignore[attr-defined]
        return cast("list[H]", self._radiating[key])


def is_study(folder: Path) -> bool:
    """Return True for the folder of a finished study."""
    return os.path.isfile(folder / "study.csv") and not os.path.isfile(folder / "summary.json")


def stored_results(folder: Path) -> Stored:
    """Return the results that `run` or `compare` left in a folder, completely or in part; InputError without any."""
    require(
        not is_study(folder),
        f"{folder} is that of a study: run `nvhchain study FILE --out {folder}` again for its page; finished rows are "
        "taken from it",
    )
    require(
        os.path.isfile(folder / "summary.json") or not os.path.isfile(folder / TRADEOFF),
        f"{folder} is that of a trade-off: its table is tradeoff.csv; `nvhchain report {folder}` writes its page",
    )
    try:
        return _stored(folder, *_summary(folder))
    except OSError as error:
        raise InputError(f"{folder}: {error.strerror or error}: name the folder of a run or comparison") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{folder}/summary.json is not what `nvhchain run` or `compare` leaves ({error!r:.100}): run it again"
        ) from None


def _summary(folder: Path) -> tuple[dict[str, Any], Path]:
    """Return the summary of a folder and that of its shared operators.

    The folder of one design of a comparison has the part of the design, without what refers to other designs or to
    files beside the comparison. A design that ran again with another level has none.
    """
    summary, place = json_table(folder / "summary.json"), folder.resolve()
    found = {} if summary else json_table(place.parent / "summary.json")
    part = found.get("configurations", {}).get(place.name)
    level = None if part is None else _stored_level(place)
    if part is None or (level is not None and abs(level - part["overall_dBA"]) >= SAME_LEVEL):
        return summary, folder / _SHARED
    alone = {key: value for key, value in part.items() if key not in ("causes", "difference_limits_db", "sound")}
    named: dict[str, Any] = {
        key: {name: value for name, value in found[key].items() if name == place.name}
        for key in ("assumptions", "modelling")
        if key in found
    }
    return {**found, **named, "configurations": {place.name: alone}}, place.parent / _SHARED


def _stored_level(folder: Path) -> float | None:
    """Return the level (dB(A)) of the sound in a folder at the first field point; None without any."""
    steady, history = folder / "pressure.h5", folder / "pressure_history.h5"
    if steady.is_file():
        pressure = hdf5.load(steady, FieldPressure)
        return float(levels.overall(pressure.frequency, pressure.pressure[:, 0]))
    if history.is_file():
        record = hdf5.load(history, PressureHistory)
        return float(levels.equivalent(record.pressure[:, 0], sample_rate=sample_rate(record)))
    return None


def _stored(folder: Path, summary: dict[str, Any], operators: Path) -> Stored:
    if summary:
        names = list(summary["configurations"])
        require(len(names) > 0, f"{folder}/summary.json holds no configuration: run `nvhchain compare` again")
        check_names(names, f"{folder}/summary.json: configurations")
        _check_levels(summary)
    else:
        names = [] if _has_results(folder) else _begun(folder)
    runs = []
    for name in names or [str(json_table(folder / "case.json").get("name", folder.resolve().name))]:
        place = folder / name if (folder / name).is_dir() else folder
        part = summary["configurations"][name] if summary else {}
        runs.append(StoredRun(name, place, part, json_table(place / "case.json")))
    require(
        bool(summary) or any(_has_results(run.folder) for run in runs),
        f"{folder} holds no results: run `nvhchain run` or `nvhchain compare` first, with --out {folder}",
    )
    return Stored(folder, summary, tuple(runs), operators)


def _check_levels(summary: Mapping[str, Any]) -> None:
    """Raise a ValueError, TypeError or KeyError for a summary whose levels are no numbers."""
    fidelity, point = summary["fidelity"], summary["field_point"]
    for configuration in summary["configurations"].values():
        if "overall_dBA" in configuration or "other_quantities" not in configuration:
            _ = f"{configuration['overall_dBA']:.1f}{point['name']}{fidelity}"
        lower, upper = configuration.get("error_band_dBA", (None, 0.0))
        _ = f"{0.0 if lower is None else lower:.1f}{0.0 if upper is None else upper:.1f}"


def _begun(folder: Path) -> list[str]:
    """Return the names of the configurations of a comparison that has not ended."""
    inside = sorted(path for path in folder.glob("*") if path.is_dir() and path.name not in (_SHARED, ESTIMATES))
    return [path.name for path in inside if (path / "case.json").is_file() or _has_results(path)]


def _has_results(folder: Path) -> bool:
    return next(folder.glob("*.h5"), None) is not None


def json_table(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file; empty for a missing file."""
    if not path.is_file():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path} cannot be read ({error}): run `nvhchain run` or `compare` again") from None
    require(isinstance(found, dict) and bool(found), f"{path} holds no table: run `nvhchain run` or `compare` again")
    return dict(found)


def rounded(values: Iterable[float | None], digits: int = 2) -> list[float | None]:
    """Return numbers for JSON; None for none, or for one that is not finite."""
    return [None if value is None or not np.isfinite(value) else round(float(value), digits) for value in values]


def significant(values: Iterable[float | None]) -> list[float | None]:
    """Return numbers for JSON with seven significant digits; None for none, or for one that is not finite."""
    return [None if value is None or not np.isfinite(value) else float(f"{value:.7g}") for value in values]
