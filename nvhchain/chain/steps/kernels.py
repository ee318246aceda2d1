"""Compiled code for the steps of a case."""

from __future__ import annotations

from nvhchain import acoustics, dynamics
from nvhchain.case import FIELD_POINT_QUANTITIES, RADIATED, GearboxCase
from nvhchain.fidelity import Fidelity


def compile_kernels(case: GearboxCase, fidelity: Fidelity) -> None:
    """Compile the code in advance, or read it from disk."""
    dynamics.compile_time_loop()
    if {*FIELD_POINT_QUANTITIES, *RADIATED}.intersection(case.quantities):
        acoustics.compile_kernels(case.engine, fidelity.acoustics)
