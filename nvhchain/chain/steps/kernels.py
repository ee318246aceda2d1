"""Compiled code that the stages of a case will call."""

from __future__ import annotations

from nvhchain import acoustics, dynamics
from nvhchain.case import HEARD, RADIATED, GearboxCase
from nvhchain.fidelity import Fidelity


def compile_kernels(case: GearboxCase, fidelity: Fidelity) -> None:
    """Have it compiled, or read from disk, while there is time to."""
    dynamics.compile_time_loop()
    if {*HEARD, *RADIATED}.intersection(case.quantities):
        acoustics.compile_kernels(case.engine, fidelity.acoustics)
