"""Provenance of boundary element results, and the accuracy that follows from the record of the solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from nvhchain.acoustics.interpolation.adaptive import MASTER_KNOBS, Chosen, error_decibel
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.handoff import RadiationResistance, SolverRecord, SoundAccuracy, TransferVectors

if TYPE_CHECKING:
    from nvhchain.acoustics.solutions.exterior import ExteriorProblem
    from nvhchain.acoustics.solutions.quantity import Quantity


H = TypeVar("H", TransferVectors, RadiationResistance)


def solution_provenance(
    problem: ExteriorProblem, step: str, other_knobs: Sequence[str], record: SolverRecord
) -> dict[str, Any]:
    """Return the provenance of a solution: knobs, with `other_knobs`, and solver record."""
    knobs = (*problem.engine.knobs, "field_near_ratio", "solver", *other_knobs)
    if record.tolerance:
        knobs = (*knobs, "solver_residual", "solver_iterations")
    if "compressed" in (record.solvers or ()):
        knobs = (*knobs, "compression_error")
    return {
        "stage": f"acoustics.{step}",
        "fidelity": knob_text(problem.fidelity, knobs),
        "engine": problem.engine.name,
        **record.provenance,
    }


def adapted_masters(problem: ExteriorProblem, chosen: Chosen[H], quantity: type[Quantity]) -> H:
    """Return the chosen masters, with the knobs of the choice in the provenance."""
    record, accuracy = sum(chosen.records, SolverRecord()), chosen.masters.accuracy
    if problem.fidelity.radiation == "boundary_elements":
        made = solution_provenance(problem, quantity.step, (*quantity.knobs, *MASTER_KNOBS), record)
        accuracy |= solver_accuracy(SoundAccuracy(), record, problem.fidelity)
    else:
        taken = knob_text(problem.fidelity, ("radiation", "field_near_ratio", *MASTER_KNOBS))
        made = {"stage": f"acoustics.{quantity.step}", "fidelity": taken}
    made = chosen.masters.provenance | made
    return chosen.masters.replace(accuracy=accuracy | chosen.accuracy, provenance=made)


def knob_text(fidelity: AcousticsFidelity, knobs: Sequence[str]) -> str:
    """Return some knobs as text."""
    return f"AcousticsFidelity({', '.join(f'{name}={getattr(fidelity, name)!r}' for name in knobs)})"


COMPRESSION_GROWTH = 5.0
"""Ratio of the relative error of a vector to `compression_error`, for spheres, boxes, a slab, a rod and a resonator.
They have 320 to 1280 triangles at 100 to 2000 Hz. The ratio is 0.2 to 5 at 1e-2, with 6 and 11 in two cases, 0.05 to
1.4 at 1e-3 and below 0.5 at 1e-5."""

RESIDUAL_GROWTH = 1.0
"""Ratio of the relative error of a vector to the residual of an iteration: 0.02 to 0.9."""

LEAST_ERROR = 1e-4
"""Relative error (0.001 dB) below which nothing is added."""


def solver_accuracy(expected: SoundAccuracy, record: SolverRecord, fidelity: AcousticsFidelity) -> SoundAccuracy:
    """Return the result of `expected_accuracy` with the error of the solver, if that is significant.

    The error has an entry of its own, `solver_error_db`, and is added to the expected errors.
    """
    error = RESIDUAL_GROWTH * record.residual
    if "compressed" in (record.solvers or ()):
        error += COMPRESSION_GROWTH * fidelity.compression_error
    if error < LEAST_ERROR:
        return expected

    def added(stated: float | None) -> float | None:
        return None if stated is None else error_decibel(10 ** (stated / 20) - 1 + error)

    return expected.replace(
        expected_error_db=added(expected.expected_error_db),
        expected_error_low_db=added(expected.expected_error_low_db),
        expected_error_nearest_db=added(expected.expected_error_nearest_db),
        expected_error_patch_db=added(expected.expected_error_patch_db),
        solver_error_db=error_decibel(error),
    )
