"""Estimate of the root stress of the teeth, which finds torques in a wrong unit."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos
from typing import TYPE_CHECKING

from nvhchain.gear import GearPair

if TYPE_CHECKING:
    from nvhchain.case.gearbox import GearboxCase

ROOT_FACTOR = 3.0
"""Product Y_F Y_S Y_ε of form, stress correction and contact ratio of ISO 6336-3, usual from 17 teeth on (2.5…3.5)."""

BREAKING_STRESS = 2.6e9
"""Root stress (Pa) at which the best case-hardened steel breaks at the first load.

Source: ISO 6336-5, quality ME, allowable 1050 MPa for endless life, times the life factor 2.5 of ISO 6336-3 for
a static load.
"""


def root_stress(pair: GearPair, force: float) -> float:
    """Return the order of magnitude of the nominal root stress (Pa) under a normal force (N).

    Source: ISO 6336-3, σ_F0 = F_t/(b m_n) Y_F Y_S Y_ε, with a common value of the factors.
    """
    pinion = pair.pinion.geometry
    tangential = abs(force) * cos(pinion.normal_pressure_angle) * cos(pinion.helix_angle)
    return ROOT_FACTOR * tangential / (pair.face_width * pinion.normal_module)


def breaking_teeth(case: GearboxCase) -> Iterator[str]:
    """Yield a message for every stage whose teeth break under the torque of the case."""
    operation = case.operation
    for stage, pair, force in zip(case.stages, case.pairs, case.mesh_forces, strict=True):
        stress = root_stress(pair, force)
        if stress <= BREAKING_STRESS:
            continue
        driven = operation.input_torque != 0 and not case.idles(stage)
        name = "input_torque" if driven else "mesh_torque"
        torque = operation.input_torque if driven else operation.mesh_torque or 0.0
        most = abs(torque) * BREAKING_STRESS / stress
        yield (
            f"operation: {name} = {torque:g} N m breaks the teeth of stage {stage.name}: its root stress is about "
            f"{_rounded(1e-6 * stress)} MPa (ISO 6336-3, order of magnitude), hardened steel breaks at "
            f"{1e-6 * BREAKING_STRESS:.0f} MPa: at most {_rounded(most)} N m; if it is in N mm, write {1e-3 * torque:g}"
        )


def _rounded(value: float) -> str:
    """Return two significant digits, without exponent."""
    return f"{float(f'{value:.2g}'):.10g}"
