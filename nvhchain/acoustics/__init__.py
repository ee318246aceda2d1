"""Exterior acoustics: boundary elements, transfer vectors and what a vibrating surface radiates."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.acoustics.accuracy.radiation_levels import expected_radiation_error
    from nvhchain.acoustics.radiation.directivity import directivity
    from nvhchain.acoustics.radiation.efficiency import (
        directivity_index,
        equivalent_pressure,
        equivalent_radiated_power,
        mean_square_velocity,
        radiation_efficiency,
        spread_power,
        surface_efficiency,
    )
    from nvhchain.acoustics.radiation.microphones import array_points, array_power
    from nvhchain.acoustics.radiation.modal_power import (
        loaded_bearings,
        modal_efficiency,
        modal_power,
        power_from_waves,
    )
    from nvhchain.acoustics.radiation.modal_transfer import (
        modal_pressure,
        modal_transfer_vectors,
        noise_transfer_functions,
        transfer_pressure,
    )
    from nvhchain.acoustics.radiation.projection import interpolate_vectors
    from nvhchain.acoustics.radiation.radiate import interpolation_error, radiate
    from nvhchain.acoustics.radiation.run_up_sound import convolution_lines, decay_time, run_up_pressure
    from nvhchain.acoustics.radiation.wave_pressure import enclosing_sphere, wave_pressure
    from nvhchain.acoustics.solutions.exterior import ExteriorProblem
    from nvhchain.acoustics.solutions.functions import (
        radiation_resistance,
        solve_direct,
        sound_power,
        surface_pressure,
        transfer_vectors,
    )
    from nvhchain.acoustics.solutions.quantities import SurfaceShapes, housing_shapes
    from nvhchain.acoustics.solutions.work import Adaptive, Work
    from nvhchain.acoustics.surfaces.needles import remesh_needles
    from nvhchain.acoustics.surfaces.reflecting_plane import RigidPlane
    from nvhchain.acoustics.surfaces.surface import check_mesh, check_points, required_element_size, sphere
    from nvhchain.acoustics.surfaces.velocity_mapping import map_velocity
    from nvhchain.acoustics.systems.engines import ENGINES, Bempp, Engine, Fused, compile_kernels, estimate_memory
    from nvhchain.acoustics.waves.incident import PlaneWave, PointSource
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = [
    "ENGINES",
    "Engine",
    "ExteriorProblem",
    "PlaneWave",
    "PointSource",
    "RigidPlane",
    "Work",
    "directivity",
    "modal_pressure",
    "modal_transfer_vectors",
    "noise_transfer_functions",
    "radiate",
    "solve_direct",
    "sound_power",
    "sphere",
    "transfer_vectors",
]
