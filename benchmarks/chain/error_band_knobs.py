"""Error bands of single knobs against the errors of the shipped sweep.

    python -m benchmarks error_band_knobs

Writes docs/measured/chain/error_band_knobs.md. Runs cases/small/single_stage.toml once at `draft` (ten seconds); the
band of every row of the sweep is that of its knobs on these hand-offs: relative to each line, it hardly feels from
which preset they come. The surface is meshed, and the error of excluded modes stated, as the row has them. What
elements leave open of natural frequencies goes with their size. What the rest of `draft` would leave open of masters
and modes is not counted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

import nvhchain as nvh
from benchmarks.publish import publish
from nvhchain import acoustics
from nvhchain.acoustics.accuracy.mesh_error import expected_accuracy
from nvhchain.case import GearboxCase
from nvhchain.chain.result import Result
from nvhchain.error_band import ErrorBand, Origin, error_band
from nvhchain.fidelity import DRAFT, REFERENCE, AcousticsFidelity, Fidelity
from nvhchain.fidelity.housing import HousingFidelity
from nvhchain.handoff import HousingAccuracy, SoundAccuracy, Surface
from nvhchain.housing import Casting, reduce_housing
from nvhchain.housing.casting.mesh import radiating_surface
from nvhchain.tradeoff import Measurement, shipped_sweep, variants
from nvhchain.tradeoff.deviation import Deviation
from nvhchain.tradeoff.knobs import FINER_SETTINGS

CASE = Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml"
OF_MASTERS = ("acoustics.masters", "acoustics.master_tolerance_db", "acoustics.interpolation")
OF_MODES = ("housing.mode_ratio", "housing.residual_flexibility", "preset")


@dataclass(frozen=True)
class Verdict:
    """Of one row.  found, limits: dB, of the overall level and of the line that is nearest to its limit.

    found: error of the row; limits: of errors that the band holds, lower and upper.
    """

    overall: float
    overall_limits: tuple[float, float]
    worst: float
    worst_limits: tuple[float, float]
    order: float

    @property
    def holds(self) -> bool:
        """Whether the yardstick lies in the band."""
        return all(
            low <= found <= high
            for found, (low, high) in ((self.overall, self.overall_limits), (self.worst, self.worst_limits))
        )


def judged_rows(run: Result) -> dict[tuple[str, str], Verdict]:
    """(knob, value) → verdict of every row of the shipped sweep that has an error of its own."""
    case, sweep, run = run.case, shipped_sweep(), at_mesh_harmonics(run)
    known = {(knob, value): fidelity for knob, value, fidelity in variants(case, REFERENCE)}
    rows = [row for row in sweep.measurements[1:] if row.deviation is not None and _errs(row)]
    return {
        (row.knob, row.value): verdict(row.deviation, band_of(run, row.knob, known[row.knob, row.value]), run)
        for row in rows
        if row.deviation is not None and (row.knob, row.value) in known
    }


def at_mesh_harmonics(run: Result) -> Result:
    """The run at its loud lines alone: nothing else of a solid gear set is heard."""
    pressure, velocity = run.pressure, run.surface_velocity
    assert pressure is not None
    assert velocity is not None
    size = np.abs(pressure.pressure).max(axis=1)
    loud = size > 1e-3 * size.max()
    return replace(
        run,
        pressure=pressure.replace(frequency=pressure.frequency[loud], pressure=pressure.pressure[loud]),
        surface_velocity=velocity.replace(
            frequency=velocity.frequency[loud], normal_velocity=velocity.normal_velocity[loud]
        ),
    )


def band_of(run: Result, knob: str, fidelity: Fidelity) -> ErrorBand:
    """Band of the pressure for a setting of the sweep, on hand-offs of another."""
    case, pressure, velocity, vectors = run.case, run.pressure, run.surface_velocity, run.transfer_vectors
    assert isinstance(case, GearboxCase)
    assert pressure is not None
    assert velocity is not None
    assert vectors is not None
    assert run.housing is not None
    coarser = fidelity.housing.element_size / run.fidelity.housing.element_size
    stated = run.housing.accuracy
    assert stated.frequency_error is not None
    told = _truncation(case, replace(run.fidelity.housing, mode_ratio=fidelity.housing.mode_ratio))
    wrong = HousingAccuracy(frequency_error=coarser * stated.frequency_error)
    housing = run.housing.replace(accuracy=stated | told | wrong)
    sound = _told(case, fidelity.acoustics)
    made = error_band(
        Origin(
            case,
            fidelity,
            housing=housing,
            force_spectrum=run.force_spectrum,
            mesh_laws=run.mesh_laws,
        ),
        pressure,
        velocity,
        transfer_vectors=vectors.replace(accuracy=sound),
    )
    dropped = {"masters"} if not knob.startswith((*OF_MASTERS, "preset")) else set()
    dropped |= {"excluded modes"} if not knob.startswith(OF_MODES) else set()
    return replace(made, sources={name: source for name, source in made.sources.items() if name not in dropped})


@cache
def _truncation(case: GearboxCase, fidelity: HousingFidelity) -> HousingAccuracy:
    """Error that the case's housing states of its excluded modes, with modes to the fidelity's multiple of the band."""
    assert isinstance(case.housing, Casting)
    made = reduce_housing(case.housing, f_max=case.band.high, surface_size=0.03, fidelity=fidelity).accuracy
    return HousingAccuracy(
        truncation_error_db=made.truncation_error_db,
        truncation_frequency=made.truncation_frequency,
        truncation_error_at_db=made.truncation_error_at_db,
    )


def verdict(found: Deviation, band: ErrorBand, run: Result) -> Verdict:
    """Limits of errors are the mirrored limits of the true level."""
    assert run.pressure is not None
    turns = run.pressure.input_speed / (2 * np.pi)
    level = 20 * np.log10(band.amplitude / (2**0.5 * band.reference))
    lower, upper = (-(band.upper - level).min(axis=1), -(band.lower - level).max(axis=1))
    errors = {
        order: (error, _limits(band.frequency / turns, order, lower, upper)) for order, error in found.orders.items()
    }
    order = max(errors, key=lambda order: _used(*errors[order]))
    overall = band.overall[:, ::-1] - band.level[:, None]
    return Verdict(found.overall, (float(-overall[:, 0].min()), float(-overall[:, 1].max())), *errors[order], order)


def _limits(orders: np.ndarray, order: float, lower: np.ndarray, upper: np.ndarray) -> tuple[float, float]:
    line = int(np.abs(orders - order).argmin())
    return float(lower[line]), float(upper[line])


def _used(error: float, limits: tuple[float, float]) -> float:
    """Part of the band's half width that an error takes."""
    return abs(error) / max(abs(limits[0] if error < 0 else limits[1]), 1e-9)


def _errs(row: Measurement) -> bool:
    """What models more than the yardstick does errs by nothing."""
    return (row.knob, row.value) not in FINER_SETTINGS


@cache
def _told(case: GearboxCase, fidelity: AcousticsFidelity) -> SoundAccuracy:
    """What transfer vectors would say of themselves."""
    assert isinstance(case.housing, Casting)
    size = acoustics.required_element_size(case.band.high, case.air, fidelity)
    return expected_accuracy(_surface(case.housing, size), None, case.band.high, case.air, fidelity)


@cache
def _surface(casting: Casting, size: float) -> Surface:
    """Most settings of the acoustics share it."""
    return radiating_surface(casting, size)


def limit(value: float) -> str:
    """dB; beyond 99 there is none."""
    return "none" if abs(value) > 99 else f"{value:+.2f}"


def main() -> None:
    """Judge and publish."""
    case = nvh.load_case(CASE)
    verdicts = judged_rows(nvh.run(case, fidelity=DRAFT))
    held = sum(one.holds for one in verdicts.values())
    lines = [
        f"In {held} of {len(verdicts)} settings of the shipped sweep the band holds the overall level and every mesh "
        "harmonic. Errors, and the limits within which the band holds them, of the overall level and of the harmonic "
        "that uses most of its band.",
        "",
        "| knob | value | dB(A) | limits | harmonic / dB | limits | of order | held |",
        "|---|---|---:|---:|---:|---:|---:|---|",
    ]
    for (knob, value), one in verdicts.items():
        limits = [" … ".join(map(limit, pair)) for pair in (one.overall_limits, one.worst_limits)]
        lines.append(
            f"| {knob} | {value} | {one.overall:+.3f} | {limits[0]} | {one.worst:+.3f} | {limits[1]} | {one.order:g} | "
            f"{'yes' if one.holds else 'no'} |"
        )
    publish("chain/error_band_knobs", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
