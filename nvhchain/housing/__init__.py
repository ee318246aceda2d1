"""Gearbox casting: mesh, reduction to modes and residual flexibility, forced response of its surface."""

from nvhchain.housing.casting import Bore, Casting, GearSpace
from nvhchain.housing.craig_bampton import CraigBampton, craig_bampton
from nvhchain.housing.damping import DampingCurve
from nvhchain.housing.extent import encloses, envelope_area
from nvhchain.housing.reduction import reduce_housing
from nvhchain.housing.response import respond
from nvhchain.housing.truncation import TruncationError, truncation_error

__all__ = [
    "Bore",
    "Casting",
    "CraigBampton",
    "DampingCurve",
    "GearSpace",
    "TruncationError",
    "craig_bampton",
    "encloses",
    "envelope_area",
    "reduce_housing",
    "respond",
    "truncation_error",
]
