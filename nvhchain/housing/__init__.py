"""Gearbox casting: mesh, reduction to modes and residual flexibility, forced response of its surface."""

from nvhchain.housing.casting import Bore, Casting, GearSpace
from nvhchain.housing.extent import encloses, envelope_area
from nvhchain.housing.reduction import reduce_housing
from nvhchain.housing.response import respond

__all__ = ["Bore", "Casting", "GearSpace", "encloses", "envelope_area", "reduce_housing", "respond"]
