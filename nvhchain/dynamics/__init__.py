"""Gearbox dynamics: rigid shafts, bearings, reduced housing and nonlinear gear meshes give bearing forces."""

from nvhchain.dynamics.gearbox import Bearing, Cylinder, Gearbox, Mesh, RigidBody, Shaft
from nvhchain.dynamics.quasi_static import static_bearing_forces
from nvhchain.dynamics.steady import bearing_forces
from nvhchain.dynamics.train import Train, train

__all__ = [
    "Bearing",
    "Cylinder",
    "Gearbox",
    "Mesh",
    "RigidBody",
    "Shaft",
    "Train",
    "bearing_forces",
    "static_bearing_forces",
    "train",
]
