"""What compressed matrices and unfinished iterations add to the error that a mesh lets expect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nvhchain.acoustics.linear_system import SolverRecord
from nvhchain.fidelity import AcousticsFidelity

COMPRESSION_GROWTH = 2.0
"""Error at field points relative to their peak, over `compression_error`: 0.5 to 3.2 for the vectors of a sphere, boxes
and a slab of 216 to 1640 triangles at 100 to 2000 Hz, and once 4.4."""

RESIDUAL_GROWTH = 1.0
"""The same over the residual that an iteration left: 0.02 to 0.9."""

LEAST = 1e-4
"""Relative error, 0.001 dB, below which nothing is added."""

_STATED = ("expected_error_dB", "expected_error_low_dB", "expected_error_nearest_dB", "expected_error_patch_dB")


def with_solver_error(expected: Mapping[str, Any], record: SolverRecord, fidelity: AcousticsFidelity) -> dict[str, Any]:
    """What `expected_accuracy` expects, with the error of the solver where there is one to speak of: by itself as
    `solver_error_dB`, and as part of the expected errors."""
    error = RESIDUAL_GROWTH * record.residual
    if "compressed" in record.solvers:
        error += COMPRESSION_GROWTH * fidelity.compression_error
    if error < LEAST:
        return dict(expected)
    stated = {name: _decibel(10 ** (expected[name] / 20) - 1 + error) for name in _STATED if name in expected}
    return {**expected, **stated, "solver_error_dB": _decibel(error)}


def _decibel(relative_error: float) -> float:
    return float(20.0 * np.log10(1.0 + relative_error))
