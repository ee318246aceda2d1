"""Gearbox dynamics: shafts, bearings, reduced housing and nonlinear gear meshes give bearing forces."""

from nvhchain.dynamics.friction import MeshFriction
from nvhchain.dynamics.gearbox import Bearing, Cylinder, Gearbox, Mesh, RigidBody, Shaft
from nvhchain.dynamics.law_range import remind
from nvhchain.dynamics.linear import flank_transfer
from nvhchain.dynamics.load_centre import LoadCentre
from nvhchain.dynamics.mesh_levels import ContactForce
from nvhchain.dynamics.quasi_static import static_bearing_forces, static_misalignment
from nvhchain.dynamics.recording import Recording, record_run_up
from nvhchain.dynamics.rigid_train import run_up_time
from nvhchain.dynamics.run_up_record import run_up, run_up_with_error
from nvhchain.dynamics.simulation import compile_time_loop
from nvhchain.dynamics.steady import bearing_forces, steady_sweep
from nvhchain.dynamics.train import Train, train

__all__ = [
    "Bearing",
    "ContactForce",
    "Cylinder",
    "Gearbox",
    "LoadCentre",
    "Mesh",
    "MeshFriction",
    "Recording",
    "RigidBody",
    "Shaft",
    "Train",
    "bearing_forces",
    "compile_time_loop",
    "flank_transfer",
    "record_run_up",
    "remind",
    "run_up",
    "run_up_time",
    "run_up_with_error",
    "static_bearing_forces",
    "static_misalignment",
    "steady_sweep",
    "train",
]
