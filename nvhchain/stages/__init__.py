"""Every stage of the chain on the shelf: what of a case and which hand-offs it takes; `chain` knows their order."""

from nvhchain.stages.motion import (
    force_spectrum,
    given_velocity,
    mesh_laws,
    reduced_housing,
    run_up_forces,
    steady_forces,
    surface_velocity,
    with_gear_inertia,
)
from nvhchain.stages.sound import (
    equivalent_pressure,
    modal_power,
    noise_transfer_functions,
    pressure,
    pressure_history,
    radiation_resistance,
    sound_power,
    transfer_vectors,
)

__all__ = [
    "equivalent_pressure",
    "force_spectrum",
    "given_velocity",
    "mesh_laws",
    "modal_power",
    "noise_transfer_functions",
    "pressure",
    "pressure_history",
    "radiation_resistance",
    "reduced_housing",
    "run_up_forces",
    "sound_power",
    "steady_forces",
    "surface_velocity",
    "transfer_vectors",
    "with_gear_inertia",
]
