"""Provenance of boundary element results: the knobs on which they depend, and the record of the solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from nvhchain.acoustics.accuracy.solver_error import solver_accuracy
from nvhchain.acoustics.interpolation.adaptive import KNOBS, Chosen
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
        made = solution_provenance(problem, quantity.step, (*quantity.knobs, *KNOBS), record)
        accuracy |= solver_accuracy(SoundAccuracy(), record, problem.fidelity)
    else:
        taken = knob_text(problem.fidelity, ("radiation", "field_near_ratio", *KNOBS))
        made = {"stage": f"acoustics.{quantity.step}", "fidelity": taken}
    made = chosen.masters.provenance | made
    return chosen.masters.replace(accuracy=accuracy | chosen.accuracy, provenance=made)


def knob_text(fidelity: AcousticsFidelity, knobs: Sequence[str]) -> str:
    """Return some knobs as text."""
    return f"AcousticsFidelity({', '.join(f'{name}={getattr(fidelity, name)!r}' for name in knobs)})"
