"""Figures of hand-offs as matplotlib axes; `axes[0].figure.savefig("spectrum.png")` writes a figure."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.plots.bodies.gear_field import gear_field
    from nvhchain.plots.bodies.gearbox import gearbox
    from nvhchain.plots.bodies.gears import gear_mesh, gear_pair
    from nvhchain.plots.bodies.shapes import animate, mode_shapes, operating_shape
    from nvhchain.plots.bodies.surface import rendered_surface, strongest_line, surface_velocity
    from nvhchain.plots.contributions import contribution_bars, modal_assurance_table
    from nvhchain.plots.differences import Table, difference_table
    from nvhchain.plots.history import mesh_names, pressure_history, transmission_error_history
    from nvhchain.plots.lumped import backbone_curves, order_spectra, rig_responses, sweep_responses
    from nvhchain.plots.marks import COLOURS, OrderMarks
    from nvhchain.plots.mesh import mesh_law_map, transmission_errors
    from nvhchain.plots.radiated import directivity_polar, directivity_spectrum, efficiency_spectrum
    from nvhchain.plots.spectrum import bearing_force_spectra, power_spectrum, pressure_spectrum
    from nvhchain.plots.speed import campbell, levels_over_speed
    from nvhchain.plots.waterfall import mean_spectra, waterfall_maps
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__ = [
    "OrderMarks",
    "backbone_curves",
    "pressure_history",
    "pressure_spectrum",
    "surface_velocity",
    "transmission_errors",
    "waterfall_maps",
]
