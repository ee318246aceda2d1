"""The frozen objects that cross the borders between stages; each checks itself when it is made.

Leading axis frequency or time, C-contiguous float64/complex128 arrays, SI units (Hz on frequency axes).
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
    "ACCURACIES",
    "HAND_OFFS",
    "Accuracy",
    "BearingForces",
    "ComplexArray",
    "Directivity",
    "FieldPressure",
    "FloatArray",
    "ForceAccuracy",
    "ForceSpectrum",
    "HandOff",
    "HousingAccuracy",
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
    "SolverRecord",
    "SoundAccuracy",
    "SoundPower",
    "Surface",
    "SurfaceAccuracy",
    "SurfacePressure",
    "SurfaceVelocity",
    "TransferVectors",
    "warn_of",
]
