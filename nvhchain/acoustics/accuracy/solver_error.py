"""What compressed matrices and unfinished iterations add to the error that a mesh lets expect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nvhchain.acoustics.systems.linear_system import SolverRecord
from nvhchain.fidelity import AcousticsFidelity

COMPRESSION_GROWTH = 5.0
"""Error of a vector, relative, over `compression_error`, for spheres, boxes, a slab, a rod and a resonator of 320 to
1280 triangles at 100 to 2000 Hz: 0.2 to 5 where that is 1e-2, and twice 6 and 11; 0.05 to 1.4 at 1e-3, below 0.5 at
1e-5."""

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
