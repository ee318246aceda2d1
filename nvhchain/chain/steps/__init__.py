"""Every stage of the chain on the shelf: what of a case and which hand-offs it takes; `chain` knows their order."""

from nvhchain.chain.steps.dynamics import bearing_forces, gearbox_of, recording
from nvhchain.chain.steps.gears import Compliances, compliances, load_distributions, mesh_laws, under_load
from nvhchain.chain.steps.kernels import compile_kernels
from nvhchain.chain.steps.motion import force_spectrum, given_velocity, reduced_housing, surface_velocity
from nvhchain.chain.steps.power import (
    directivity,
    modal_efficiency,
    modal_power,
    radiation_efficiency,
    radiation_resistance,
    sound_power,
)
from nvhchain.chain.steps.sound import (
    equivalent_pressure,
    noise_transfer_functions,
    pressure,
    pressure_history,
    transfer_vectors,
)

__all__ = [
    "Compliances",
    "bearing_forces",
    "compile_kernels",
    "compliances",
    "directivity",
    "equivalent_pressure",
    "force_spectrum",
    "gearbox_of",
    "given_velocity",
    "load_distributions",
    "mesh_laws",
    "modal_efficiency",
    "modal_power",
    "noise_transfer_functions",
    "pressure",
    "pressure_history",
    "radiation_efficiency",
    "radiation_resistance",
    "recording",
    "reduced_housing",
    "sound_power",
    "surface_velocity",
    "transfer_vectors",
    "under_load",
]
