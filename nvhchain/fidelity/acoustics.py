"""Knobs of boundary elements and master frequencies."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from nvhchain.errors import is_whole, require
from nvhchain.fidelity.knob import Knobs, Sweep, knob


# fmt: off
@dataclass(frozen=True)
class AcousticsFidelity(Knobs, package="acoustics"):
    """Boundary elements and master frequencies."""

    elements_per_wavelength: float = knob(low=1.0, high=100.0, step="surface",
        sweep=Sweep(((2.5, 2.0), (3.0, 2.0), (4.0, 2.0)),
                    ("elements_per_wavelength", "coarsest_elements_per_wavelength")),
        meaning="elements per wavelength of a radiating surface made here, at the upper band limit")
    masters: int = knob(low=1, high=10_000, sweep="the most masters that master_tolerance_db may take",
        meaning="master frequencies over the band; their largest number where `master_tolerance_db` chooses them")
    quadrature_order: int = knob(2, low=1, high=20, sweep=(1, 2, 3),
        meaning="least Gauss order of well separated triangle pairs")
    quadrature_error: float = knob(2e-3, low=1e-9, high=1.0, sweep=(1e-1, 1e-2),
        meaning="relative error of the mean of a plane wave over one triangle, which the order keeps at any frequency "
                "(engine `fused` alone). The error of the pressure is 0.4 to ten times as large. Separated pairs on "
                "bodies of 0.2 m have 0.002 to 1.5 times (docs/measured/acoustics/quadrature.md)")
    close_distances: tuple[float, ...] = knob((1.5, 3.0),
        sweep=Sweep((((1.5,), (3,)), ((1.5, 3.0), (4, 3)), ((1.5, 3.0), (6, 4))), ("close_distances", "close_orders")),
        meaning="distances of centroids below which pairs take close_orders, in longest edges of the larger triangle")
    close_orders: tuple[int, ...] = knob((6, 4),
        meaning="Gauss orders of pairs nearer than the matching close_distances")
    gap_ratio: float = knob(0.3, high=2.0, sweep=(0.0, 0.1),
        meaning="triangles that face each other across less than this multiple of the longer one are cut until their "
                "pieces do not")
    gap_halvings: int = knob(5, high=8, sweep=(2,), meaning="most cuts of such triangles")
    singular_order: int = knob(4, low=1, high=20, sweep=(2, 3, 4),
        meaning="Gauss order per direction of pairs that share a corner, an edge or all")
    needle_aspect: float = knob(5.0, low=2.5, high=1e6, sweep=(20.0,),
        meaning="triangles longer than this multiple of their height take twice singular_order, beyond its square "
                "thrice. Needles that meet at their tips and point apart, as in a fan, are excepted")
    precision: str = knob("double", choices=("double", "single"), sweep=("single",),
        meaning="number format of the matrices and of well separated pairs: `double`, or `single` (half the memory; "
                "double for a band that holds a matrix singular to it)")
    field_near_ratio: float = knob(0.5, low=0.01, high=2.0, sweep=(2.0,),
        meaning="a triangle longer than this multiple of its distance from a field point is subdivided")
    coarsest_elements_per_wavelength: float = knob(2.0, low=1.0, high=100.0,
        meaning="fewest elements per wavelength of any surface; a coarser one is refused")
    solver: str = knob("auto", choices=("auto", "direct", "iterative", "compressed"),
        sweep=Sweep((("iterative", 1e-3), ("iterative", 1e-6), ("direct", 1e-10)), ("solver", "solver_residual")),
        meaning="solution of the systems: `direct` (LU factors), `iterative` (GMRES), `compressed` (GMRES on "
                "compressed matrices), or `auto`, the cheapest that fits into memory")
    solver_residual: float = knob(1e-10, low=1e-13, high=1e-2,
        meaning="admissible residual of an iterative solution, relative to the right-hand side; a tenth of "
                "compression_error is enough for compressed matrices")
    solver_iterations: int = knob(200, low=1, high=10_000, sweep="a limit, beyond which the run is refused",
        meaning="most iterations to that residual")
    compression_error: float = knob(1e-5, low=1e-7, high=1e-2,
        sweep=Sweep((("compressed", 1e-3, 1e-4), ("compressed", 1e-5, 1e-6)),
                    ("solver", "compression_error", "solver_residual")),
        meaning="relative error of the compressed matrices (Frobenius norm, in every group of rows)")
    multipole_digits: float = knob(4.0, low=1.0, high=12.0, step="sound power", sweep="of sound power only",
        meaning="decimal digits to which sound power resolves the spherical waves that leave the surface")
    radiation: str = knob("boundary_elements",
        choices=("boundary_elements", "rayleigh", "equivalent_radiated_power"),
        sweep=("equivalent_radiated_power", "rayleigh"),
        meaning="`boundary_elements`, or a cheaper level (docs/measured/acoustics/radiation.md): `rayleigh`, every "
                "visible face in an infinite baffle, or `equivalent_radiated_power`, plane waves from every face, "
                "without phase")
    interpolation_points: int = knob(8, low=2, high=16, step="interpolation", sweep=(4, 6),
        meaning="nodes (masters, and below the band their mirror images) of one interpolated value")
    interpolation_poles: int = knob(6, low=1, high=14, step="interpolation", sweep=(1, 3),
        meaning="most poles of the rational function through these nodes")
    master_tolerance_db: float = knob(0.1, low=1e-4, high=20.0, unit="dB", sweep=(1.0, 0.3, 0.1),
        meaning="error of interpolation for which masters are chosen (`Adaptive`)")
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        ratios, orders = self.close_distances, self.close_orders
        require(
            len(ratios) == len(orders) >= 1 and all(1 <= order <= 20 and is_whole(order) for order in orders),
            f"acoustics close_orders = {orders} must give a whole order of 1…20 for each of close_distances = {ratios}",
        )
        require(
            ratios[-1] >= 1.4 and all(low < high for low, high in pairwise(ratios)),
            f"acoustics close_distances = {ratios} must increase, to 1.4 at least: that far, triangles touch",
        )
