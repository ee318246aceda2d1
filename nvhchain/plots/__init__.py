"""Hand-offs in, matplotlib axes out: `axes[0].figure.savefig("spectrum.png")` writes the figure."""

from nvhchain.plots.differences import Table, difference_table
from nvhchain.plots.history import pressure_history
from nvhchain.plots.mesh import mesh_law_map, transmission_errors
from nvhchain.plots.orders import OrderMarks
from nvhchain.plots.spectrum import bearing_force_spectra, pressure_spectrum
from nvhchain.plots.surface import strongest_line, surface_velocity
from nvhchain.plots.waterfall import waterfall_maps

__all__ = [
    "OrderMarks",
    "Table",
    "bearing_force_spectra",
    "difference_table",
    "mesh_law_map",
    "pressure_history",
    "pressure_spectrum",
    "strongest_line",
    "surface_velocity",
    "transmission_errors",
    "waterfall_maps",
]
