"""Frozen objects between the steps of the chain; each checks itself when it is made.

The leading axis is frequency or time. Arrays are C-contiguous float64 or complex128, in SI units (Hz on frequency
axes).
"""

from nvhchain.handoff.accuracy import (
    ForceAccuracy,
    HousingAccuracy,
    SolverRecord,
    SoundAccuracy,
    SurfaceAccuracy,
    warn_of,
)
from nvhchain.handoff.base import ACCURACIES, HAND_OFFS, Accuracy, ComplexArray, FloatArray, HandOff, IntArray
from nvhchain.handoff.forces import BearingForces, ForceSpectrum
from nvhchain.handoff.gear_body import BodyModes, FlankFlexibility
from nvhchain.handoff.gear_field import GearField
from nvhchain.handoff.housing import ReducedHousing, SurfaceVelocity
from nvhchain.handoff.mesh_law import LoadDistribution, MeshLaw, MeshPeriod, ToothPairs
from nvhchain.handoff.sound import (
    Directivity,
    FieldPressure,
    PressureHistory,
    RadiationEfficiency,
    SoundPower,
    SurfacePressure,
)
from nvhchain.handoff.surface import Surface
from nvhchain.handoff.transfer import (
    ModalTransferVectors,
    NoiseTransferFunctions,
    RadiationResistance,
    RigidPlane,
    SolvedBand,
    TransferVectors,
)

__all__ = [
    "BearingForces",
    "FieldPressure",
    "ForceSpectrum",
    "MeshLaw",
    "PressureHistory",
    "ReducedHousing",
    "Surface",
    "SurfaceVelocity",
    "TransferVectors",
]
