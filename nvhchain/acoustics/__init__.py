"""Exterior acoustics: boundary elements, transfer vectors and what a vibrating surface radiates."""

from nvhchain.acoustics.direct import solve_direct, surface_pressure
from nvhchain.acoustics.directivity import directivity
from nvhchain.acoustics.efficiency import (
    circle_points,
    directivity_index,
    equivalent_pressure,
    equivalent_radiated_power,
    mean_square_velocity,
    radiation_efficiency,
    spread_power,
    surface_efficiency,
)
from nvhchain.acoustics.engines import ENGINES, compile_kernels, estimate_memory
from nvhchain.acoustics.incident import IncidentField, PlaneWave, PointSource
from nvhchain.acoustics.level_accuracy import expected_radiation_error
from nvhchain.acoustics.masters import adaptive_transfer_vectors
from nvhchain.acoustics.microphones import array_points, array_power
from nvhchain.acoustics.modal import modal_pressure, modal_transfer_vectors, noise_transfer_functions, transfer_pressure
from nvhchain.acoustics.modal_power import (
    loaded_seats,
    modal_efficiency,
    modal_power,
    radiation_modes,
    resistance_matrices,
    waves_power,
)
from nvhchain.acoustics.plane import RigidPlane
from nvhchain.acoustics.power import sound_power
from nvhchain.acoustics.projection import project, vectors_at
from nvhchain.acoustics.radiate import interpolation_error, radiate
from nvhchain.acoustics.radiation_resistance import (
    SurfaceShapes,
    housing_shapes,
    radiation_resistance,
)
from nvhchain.acoustics.resistance_masters import adaptive_radiation_resistance
from nvhchain.acoustics.run_up import convolution_lines, decay_time, run_up_pressure
from nvhchain.acoustics.surface import check_mesh, check_points, required_element_size, sphere
from nvhchain.acoustics.transfer import master_frequencies, transfer_vectors
from nvhchain.handoff import RadiationResistance, SoundPower, SurfacePressure

__all__ = [
    "ENGINES",
    "IncidentField",
    "PlaneWave",
    "PointSource",
    "RadiationResistance",
    "RigidPlane",
    "SoundPower",
    "SurfacePressure",
    "SurfaceShapes",
    "adaptive_radiation_resistance",
    "adaptive_transfer_vectors",
    "array_points",
    "array_power",
    "check_mesh",
    "check_points",
    "circle_points",
    "compile_kernels",
    "convolution_lines",
    "decay_time",
    "directivity",
    "directivity_index",
    "equivalent_pressure",
    "equivalent_radiated_power",
    "estimate_memory",
    "expected_radiation_error",
    "housing_shapes",
    "interpolation_error",
    "loaded_seats",
    "master_frequencies",
    "mean_square_velocity",
    "modal_efficiency",
    "modal_power",
    "modal_pressure",
    "modal_transfer_vectors",
    "noise_transfer_functions",
    "project",
    "radiate",
    "radiation_efficiency",
    "radiation_modes",
    "radiation_resistance",
    "required_element_size",
    "resistance_matrices",
    "run_up_pressure",
    "solve_direct",
    "sound_power",
    "sphere",
    "spread_power",
    "surface_efficiency",
    "surface_pressure",
    "transfer_pressure",
    "transfer_vectors",
    "vectors_at",
    "waves_power",
]
