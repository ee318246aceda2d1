"""Lumped models: a gear pair with one degree of freedom and backlash, and the torsional test rig."""

from nvhchain.lumped.gear_pairs import BASE_RADIUS, THESIS_PAIRS, thesis_pair
from nvhchain.lumped.harmonic_balance import PeriodicResponse, periodic_response
from nvhchain.lumped.integrate import Windows, integrate
from nvhchain.lumped.pair import GearPair, order_lines, pair_from_error, static_transmission_error
from nvhchain.lumped.rattle import loose_gear_pair, rattle_threshold
from nvhchain.lumped.rig import FITTED_RIG, mesh_cross_response, rig_modes
from nvhchain.lumped.stability import backbone_frequency, floquet_multipliers, stability_limit
from nvhchain.lumped.sweep import SweepResponse, run_up, steady_motion, steady_sweep

__all__ = [
    "backbone_frequency",
    "floquet_multipliers",
    "loose_gear_pair",
    "mesh_cross_response",
    "order_lines",
    "pair_from_error",
    "periodic_response",
    "rattle_threshold",
    "run_up",
    "stability_limit",
    "static_transmission_error",
    "steady_motion",
    "steady_sweep",
]
