"""Rolling bearings: force and stiffness in five motions by ISO/TS 16281, from catalogue data or internal geometry."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.bearings.balls import AngularContact, DeepGroove
    from nvhchain.bearings.internal import Internal
    from nvhchain.bearings.rollers import Cylindrical, Spherical, Tapered
    from nvhchain.bearings.springs import StiffnessMatrix, StiffnessTable
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = ["AngularContact", "Cylindrical", "DeepGroove", "Spherical", "StiffnessMatrix", "Tapered"]
