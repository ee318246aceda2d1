"""The frozen objects that cross the borders between stages; each checks itself when it is made.

Leading axis frequency or time, C-contiguous float64/complex128 arrays, SI units (Hz on frequency axes).
"""

from nvhchain.handoff.base import HAND_OFFS, ComplexArray, FloatArray, HandOff, IntArray
from nvhchain.handoff.forces import BearingForces, ForceSpectrum
from nvhchain.handoff.housing import ReducedHousing, SurfaceVelocity
from nvhchain.handoff.mesh_law import LoadDistribution, MeshLaw
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
    "HAND_OFFS",
    "BearingForces",
    "ComplexArray",
    "Directivity",
    "FieldPressure",
    "FloatArray",
    "ForceSpectrum",
    "HandOff",
    "IntArray",
    "LoadDistribution",
    "MeshLaw",
    "ModalTransferVectors",
    "NoiseTransferFunctions",
    "PressureHistory",
    "RadiationEfficiency",
    "RadiationResistance",
    "ReducedHousing",
    "RigidPlane",
    "SolvedBand",
    "SoundPower",
    "Surface",
    "SurfacePressure",
    "SurfaceVelocity",
    "TransferVectors",
]
