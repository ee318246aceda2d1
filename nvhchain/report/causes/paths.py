"""Paths and modes of single lines of a run at constant speed, from its stored hand-offs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from nvhchain import acoustics
from nvhchain.errors import InputError, silence_accuracy_warnings
from nvhchain.fidelity import STANDARD, AcousticsFidelity
from nvhchain.handoff import (
    FieldPressure,
    FloatArray,
    ForceSpectrum,
    HandOff,
    ReducedHousing,
    TransferVectors,
)
from nvhchain.housing.casting.contributions import Contributions, modal_contributions

H = TypeVar("H", bound=HandOff)

PATHS = "x", "y", "z", "moment about x", "moment about y"
"""Motions of a bearing seat."""

SUM_ERROR = 1e-3
"""Largest difference of the sum of all parts from the stored pressure, relative to the strongest line."""


def stored_parts(
    pressure: FieldPressure,
    forces: ForceSpectrum,
    operators: tuple[Sequence[TransferVectors], Sequence[ReducedHousing]],
    frequency: FloatArray,
    fidelity: AcousticsFidelity = STANDARD.acoustics,
) -> tuple[Contributions, Contributions] | None:
    """Return the pressure by path and by mode at single lines; None where no operators add up to the stored pressure.

    A path is a bearing and a direction: its force times its noise transfer function.

    operators : transfer vectors and housings on the surface, among which those of the run are.
    frequency : (n,) lines of the run (Hz), rising.
    """
    for vectors in operators[0]:
        for housing in operators[1]:
            found = line_parts(pressure, forces, housing, vectors, frequency, fidelity=fidelity)
            if found is not None:
                return found
    return None


def line_parts(
    pressure: FieldPressure,
    forces: ForceSpectrum,
    housing: ReducedHousing,
    vectors: TransferVectors,
    frequency: FloatArray,
    *,
    fidelity: AcousticsFidelity,
) -> tuple[Contributions, Contributions] | None:
    """Return the pressure by path and by mode at single lines; None where they do not add up to the pressure.

    frequency : (n,) lines of the run (Hz), rising.
    """
    rows = [np.abs(spectrum.frequency[:, None] - frequency).argmin(axis=0) for spectrum in (pressure, forces)]
    lines = forces.frequency[rows[1]]
    heard = pressure.pressure[rows[0]]
    if np.abs(pressure.frequency[rows[0]] - lines).max() > 1e-6 * lines.max():
        return None
    found = force_parts(forces.select(rows[1]), housing, vectors, fidelity)
    if found is None or np.abs(found[0].total - heard).max() > SUM_ERROR * np.abs(heard).max():
        return None
    return found


def force_parts(
    load: ForceSpectrum, housing: ReducedHousing, vectors: TransferVectors, fidelity: AcousticsFidelity
) -> tuple[Contributions, Contributions] | None:
    """Return the pressure by path and by mode that forces cause; None for operators of different surfaces."""
    try:
        with silence_accuracy_warnings():
            modal = acoustics.modal_transfer_vectors(vectors, housing, load.frequency, fidelity=fidelity)
            functions = acoustics.noise_transfer_functions(modal, housing).functions
            modes = modal_contributions(modal, housing, load)
    except InputError:
        return None
    force = load.sort_bearings(housing.names, housing.motions)
    parts = functions.reshape(*functions.shape[:2], -1) * force[:, None, :]
    names = tuple(f"{name} {axis}" for name in housing.names for axis in PATHS[: housing.motions])
    return Contributions(load.frequency, vectors.points, names, parts), modes
