"""Exterior acoustics: boundary elements, transfer vectors and what a vibrating surface radiates."""

from nvhchain.acoustics.direct import SurfacePressure, solve_direct, surface_pressure
from nvhchain.acoustics.engines import ENGINES, estimate_memory
from nvhchain.acoustics.incident import IncidentField, PlaneWave, PointSource
from nvhchain.acoustics.power import SoundPower, array_points, array_power, sound_power
from nvhchain.acoustics.projection import project, vectors_at
from nvhchain.acoustics.radiate import interpolation_error, radiate
from nvhchain.acoustics.surface import check_mesh, check_points, required_element_size, sphere
from nvhchain.acoustics.transfer import master_frequencies, transfer_vectors

__all__ = [
    "ENGINES",
    "IncidentField",
    "PlaneWave",
    "PointSource",
    "SoundPower",
    "SurfacePressure",
    "array_points",
    "array_power",
    "check_mesh",
    "check_points",
    "estimate_memory",
    "interpolation_error",
    "master_frequencies",
    "project",
    "radiate",
    "required_element_size",
    "solve_direct",
    "sound_power",
    "sphere",
    "surface_pressure",
    "transfer_vectors",
    "vectors_at",
]
