"""One run of a study: responses of a case with their limits."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from nvhchain import acoustics, chain
from nvhchain.case import Case, Deviations, GearboxCase
from nvhchain.errors import InputError, SolverError, concerning
from nvhchain.fidelity import Fidelity
from nvhchain.files.result_cache import Watcher, fingerprint
from nvhchain.handoff import (
    ForceSpectrum,
    ModalTransferVectors,
    NoiseTransferFunctions,
    ReducedHousing,
    TransferVectors,
)
from nvhchain.housing.modes.damping import damping_of_modes
from nvhchain.scene.modelling import decided
from nvhchain.study.responses import Limits, add_gears, add_levels, add_places, add_requested

_MOST_REFERENCES = 4
"""Number of references that a process holds: several speeds and torques of one study."""


def measure(
    case: Case, fidelity: Fidelity, operators: Path, asked: tuple[str, ...] = (), watcher: Watcher | None = None
) -> dict[str, Any]:
    """Run a case and return responses, limits, the reason of a refusal and seconds.

    case: case of one design at one operating point.
    operators: folder of shared operators.
    asked: responses on request.
    watcher: receives begin, progress and end of the steps.
    Returns `responses`, `limits`, `band` (record or None), `refused` (None or text) and `seconds`.
    """
    began = time.monotonic()

    def run(responses: dict[str, float], limits: Limits) -> dict[str, Any] | None:
        result = chain.run(case, fidelity=fidelity, operators=operators, watcher=watcher)
        band = add_levels(result, asked, responses, limits)
        add_gears(result, responses)
        add_requested(asked, result, responses, limits)
        return band

    return _outcome(case, run, began)


def _outcome(
    case: Case, run: Callable[[dict[str, float], Limits], dict[str, Any] | None], began: float
) -> dict[str, Any]:
    """Return what a run adds to responses and limits, or the reason of its refusal."""
    responses: dict[str, float] = {}
    limits: Limits = {}
    refused = band = None
    try:
        with concerning(case.name), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            band = run(responses, limits)
    except (InputError, SolverError, MemoryError) as error:
        responses, limits, refused = {}, {}, " ".join(str(error).split())
    return {
        "responses": responses,
        "limits": limits,
        "band": band,
        "refused": refused,
        "seconds": round(time.monotonic() - began, 3),
    }


@dataclass(frozen=True, eq=False)
class _Reference:
    """Gearbox with the deviations of the case file, and the sound per force of all draws.

    vectors, housing : shared operators.
    offsets : lower and upper limit of every response less the response (dB); None for a limit that does not exist.
    modal : line frequencies, as bytes → transfer vectors of the modes.
    """

    vectors: TransferVectors
    housing: ReducedHousing
    offsets: dict[str, list[float | None]]
    modal: dict[bytes, ModalTransferVectors] = field(default_factory=dict)

    def functions(self, housing: ReducedHousing, spectrum: ForceSpectrum, knobs: Fidelity) -> NoiseTransferFunctions:
        """Return the noise transfer functions of the housing with the damping of a draw."""
        lines = spectrum.frequency
        if lines.tobytes() not in self.modal:
            self.modal[lines.tobytes()] = acoustics.modal_transfer_vectors(
                self.vectors, self.housing, lines, fidelity=knobs.acoustics
            )
        modal = self.modal[lines.tobytes()]
        if housing is not self.housing:
            gain = housing.residual_gain() / self.housing.residual_gain()
            modal = modal.replace(residual=gain * modal.residual, housing=housing.content_hash)
        return acoustics.noise_transfer_functions(modal, housing)


_REFERENCES: dict[str, _Reference] = {}
"""Fingerprint of case and fidelity → its reference, for the runs of this process; the latest few."""


def can_be_drawn(case: Case, fidelity: Fidelity) -> bool:
    """Return True for a case whose sound follows from its bearing forces by noise transfer functions.

    case: case of one design.
    Returns True for a gearbox at constant speed, whose sound pressure is asked for by boundary elements.
    """
    solved = fidelity.acoustics.radiation == "boundary_elements"
    return isinstance(case, GearboxCase) and case.quantities == ("pressure",) and not case.running_up and solved


def measure_drawn(
    case: Case,
    mean: Case,
    fidelity: Fidelity,
    operators: Path,
    asked: tuple[str, ...] = (),
    watcher: Watcher | None = None,
) -> dict[str, Any]:
    """Run one of many cases that differ in deviations, tolerances and damping; return the same as `measure`.

    mean: case with deviations, tolerances and damping of the case file, run once in a process.
    Returns as `measure`. Limits are those of the mean case, moved along with the level.

    Mesh law and forces are computed anew. Their sound follows from noise transfer functions.
    """
    began = time.monotonic()

    def run(responses: dict[str, float], limits: Limits) -> dict[str, Any] | None:
        alike = _match_lines(mean, case)
        reference = _reference_of(alike, fidelity, operators, asked, watcher)  # limits hold the excluded options
        housing = _damped(reference.housing, case, mean)
        driven = replace(case, quantities=("bearing_forces",))
        chosen = decided(alike, fidelity)
        if isinstance(driven, GearboxCase) and isinstance(chosen, GearboxCase):
            driven = replace(driven, options=chosen.options)  # one decision for all draws
        forces = chain.run(driven, fidelity=fidelity, operators=operators, housing=housing, watcher=watcher)
        spectrum = forces.force_spectrum
        assert spectrum is not None
        pressure = acoustics.transfer_pressure(reference.functions(housing, spectrum, fidelity), spectrum)
        heard = replace(forces, case=case, pressure=pressure)
        add_places(heard, asked, responses)
        for name in set(reference.offsets).intersection(responses):
            limits[name] = [None if end is None else responses[name] + end for end in reference.offsets[name]]
        add_gears(heard, responses)
        add_requested(asked, heard, responses, limits)
        return None

    return _outcome(case, run, began)


def _match_lines(mean: Case, case: Case) -> Case:
    """Return the mean case with gears that deviate, if by nothing, where those of the other one do."""
    if not isinstance(mean, GearboxCase) or not isinstance(case, GearboxCase):
        return mean
    gears = tuple(
        replace(gear, deviations=Deviations()) if gear.deviations is None and other.deviations is not None else gear
        for gear, other in zip(mean.gears, case.gears, strict=True)
    )
    return replace(mean, gears=gears)


def _damped(housing: ReducedHousing, case: Case, mean: Case) -> ReducedHousing:
    """Return the housing of the mean case with the modal damping of another one."""
    damping, before = (
        getattr(one.housing, "modal_damping", None) for one in (case, mean) if isinstance(one, GearboxCase)
    )
    if damping is None or damping == before:
        return housing
    return housing.replace(modal_damping=damping_of_modes(damping, housing.natural_frequency))


def _reference_of(
    case: Case, fidelity: Fidelity, operators: Path, asked: tuple[str, ...], watcher: Watcher | None
) -> _Reference:
    """Return the reference of a mean case, which is run once in a process."""
    key = fingerprint(case, fidelity, str(operators), asked)
    if key not in _REFERENCES:
        result = chain.run(case, fidelity=fidelity, operators=operators, watcher=watcher)
        responses: dict[str, float] = {}
        limits: Limits = {}
        add_levels(result, asked, responses, limits)
        assert result.transfer_vectors is not None
        assert result.housing is not None
        while len(_REFERENCES) >= _MOST_REFERENCES:
            _REFERENCES.pop(next(iter(_REFERENCES)))
        offsets = {
            name: [None if limit is None else limit - responses[name] for limit in both]
            for name, both in limits.items()
        }
        _REFERENCES[key] = _Reference(result.transfer_vectors, result.housing, offsets)
    return _REFERENCES[key]
