"""Function of every step: each takes a run in progress and returns its hand-off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nvhchain.chain.running import Run
from nvhchain.chain.steps.dynamics import bearing_forces, force_spectrum, recording, reduced_housing, surface_velocity
from nvhchain.chain.steps.gears import load_distributions, mesh_law, mesh_laws, stage_ahead
from nvhchain.chain.steps.kernels import compile_kernels
from nvhchain.chain.steps.power import directivity, radiation_efficiency, radiation_resistance, sound_power
from nvhchain.chain.steps.sound import (
    noise_transfer_functions,
    pressure,
    pressure_history,
    transfer_vectors,
    transfer_vectors_ahead,
)
from nvhchain.scene import steps as table
from nvhchain.scene.steps import Step

MADE_BY: dict[Step[Any], Callable[[Run], Any]] = {
    table.HOUSING: reduced_housing,
    table.LOAD_DISTRIBUTIONS: load_distributions,
    table.MESH_LAWS: mesh_laws,
    table.BEARING_FORCES: bearing_forces,
    table.FORCE_SPECTRUM: force_spectrum,
    table.SURFACE_VELOCITY: surface_velocity,
    table.TRANSFER_VECTORS: transfer_vectors,
    table.PRESSURE: pressure,
    table.RADIATION_RESISTANCE: radiation_resistance,
    table.SOUND_POWER: sound_power,
    table.RADIATION_EFFICIENCY: radiation_efficiency,
    table.DIRECTIVITY: directivity,
    table.NOISE_TRANSFER_FUNCTIONS: noise_transfer_functions,
    table.PRESSURE_HISTORY: pressure_history,
}
"""Step of the table → the function that makes its hand-off."""

__all__ = [
    "MADE_BY",
    "compile_kernels",
    "mesh_law",
    "mesh_laws",
    "recording",
    "reduced_housing",
    "stage_ahead",
    "transfer_vectors_ahead",
]
