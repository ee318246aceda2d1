"""Gearbox dynamics: shafts, bearings, reduced housing and nonlinear gear meshes give bearing forces."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.dynamics.model.angle_laws import LoadCentre, MeshFriction
    from nvhchain.dynamics.model.fluctuation import Fluctuation, Harmonic
    from nvhchain.dynamics.model.gearbox import Gearbox
    from nvhchain.dynamics.model.parts import Bearing, LooseGear, Mesh, ShaftBearing, StaticTilt, VibratingBody
    from nvhchain.dynamics.model.shafts import Cylinder, RigidBody, Shaft, SideLoad
    from nvhchain.dynamics.model.train import train
    from nvhchain.dynamics.runs.linear import body_compliance, flank_transfers
    from nvhchain.dynamics.runs.mesh_orders import order_forces
    from nvhchain.dynamics.runs.recording import Recording, record_run_up
    from nvhchain.dynamics.runs.run_up_record import run_up, run_up_with_error
    from nvhchain.dynamics.runs.steady import bearing_forces
    from nvhchain.dynamics.runs.system_modes import SystemModes, system_modes
    from nvhchain.dynamics.time_loop.equilibrium import Equilibrium, equilibrium
    from nvhchain.dynamics.time_loop.mesh_levels import ContactForce
    from nvhchain.dynamics.time_loop.quasi_static import (
        face_loads,
        opposed_misalignment,
        static_bearing_forces,
        static_misalignment,
    )
    from nvhchain.dynamics.time_loop.simulation import compile_time_loop
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = ["Bearing", "Cylinder", "Shaft"]
