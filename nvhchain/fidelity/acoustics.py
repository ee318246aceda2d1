"""Knobs of boundary elements and master frequencies."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from nvhchain.errors import is_whole, require
from nvhchain.fidelity.limits import whole, within

SOLVERS = ("auto", "direct", "iterative", "compressed")
"""Ways to solve boundary element systems."""

RADIATIONS = ("boundary_elements", "rayleigh", "equivalent_radiated_power")
"""Ways to go from surface velocity to sound, the exact one first."""

PRECISIONS = ("double", "single")
"""Widths of the boundary element matrices: 16 and 8 bytes per entry."""


@dataclass(frozen=True)
class AcousticsFidelity:
    """Boundary elements and master frequencies.

    elements_per_wavelength: of a radiating surface made here, at the upper band limit.
    coarsest_elements_per_wavelength: of any surface, below which it is refused.
    masters: master frequencies over the band; the most of them where they are chosen by `master_tolerance_db`.
    master_tolerance_db: dB, error of interpolation for which masters are chosen (`adaptive_transfer_vectors`).
    quadrature_order: least Gauss order of well separated triangle pairs.
    quadrature_error: the order rises with the frequency (engine `fused` alone) until the mean of a plane wave over one
        triangle keeps to this relative error; that of the pressure is 0.4 to ten times as large (0.002 to 1.5 by well
        separated pairs on bodies of 0.2 m: docs/measured/acoustics/quadrature.md).
    close_orders: Gauss orders of pairs nearer than the matching close_distances, which count the distance of the
        centroids in longest edges of the larger triangle.
    gap_ratio, gap_halvings: triangles that face each other across less than this multiple of the longer one are cut
        until their pieces do not, at most this number of times.
    singular_order: Gauss order per direction of pairs that share a corner, an edge or all.
    needle_aspect: triangles longer than this multiple of their height take twice that order, beyond its square thrice,
        but for needles that meet at their tips and point apart, as those of a fan do.
    precision: of the matrices and of well separated pairs, `double` or `single` (half the memory).
    field_near_ratio: a triangle longer than this multiple of its distance from a field point is subdivided.
    solver: of the dense systems, `direct` (LU factors) or `iterative` (GMRES), `compressed` (GMRES on compressed
        matrices), or `auto`, the cheapest that fits into memory.
    solver_residual: of an iterative solution, relative to the right-hand side, reached within solver_iterations; a
        tenth of compression_error is enough for compressed matrices.
    compression_error: of the compressed matrices, relative (Frobenius norm, in every group of rows).
    multipole_digits: decimal digits to which sound power resolves the spherical waves that leave the surface.
    radiation: `boundary_elements`, or a cheaper level (docs/measured/acoustics/radiation.md): `rayleigh`, every visible
        face in an infinite baffle, or `equivalent_radiated_power`, plane waves from every face, which knows no phase.
    interpolation_points: nodes (masters, and below the band their mirror images) of one interpolated value.
    interpolation_poles: poles of the rational function through these nodes, at most.
    """

    elements_per_wavelength: float
    masters: int
    quadrature_order: int = 2
    quadrature_error: float = 2e-3
    close_distances: tuple[float, ...] = (1.5, 3.0)
    close_orders: tuple[int, ...] = (6, 4)
    gap_ratio: float = 0.3
    gap_halvings: int = 5
    singular_order: int = 4
    needle_aspect: float = 5.0
    precision: str = "double"
    field_near_ratio: float = 0.5
    coarsest_elements_per_wavelength: float = 2.0
    solver: str = "auto"
    solver_residual: float = 1e-10
    solver_iterations: int = 200
    compression_error: float = 1e-5
    multipole_digits: float = 4.0
    radiation: str = "boundary_elements"
    interpolation_points: int = 8
    interpolation_poles: int = 6
    master_tolerance_db: float = 0.1

    def __post_init__(self) -> None:
        within(
            self,
            "acoustics",
            ("elements_per_wavelength", 1.0, 100.0),
            ("coarsest_elements_per_wavelength", 1.0, 100.0),
            ("masters", 1, 10_000),
            ("quadrature_order", 1, 20),
            ("quadrature_error", 1e-9, 1.0),
            ("singular_order", 1, 20),
            ("needle_aspect", 2.5, 1e6),
            ("gap_ratio", 0.0, 2.0),
            ("gap_halvings", 0, 8),
            ("field_near_ratio", 0.01, 2.0),
            ("interpolation_points", 2, 16),
            ("interpolation_poles", 1, 14),
            ("multipole_digits", 1.0, 12.0),
            ("master_tolerance_db", 1e-4, 20.0),
            ("solver_residual", 1e-13, 1e-2),
            ("solver_iterations", 1, 10_000),
            ("compression_error", 1e-7, 1e-2),
        )
        for name in ("close_distances", "close_orders"):
            # lists cannot be hashed, and what is computed once per surface is kept by the knobs
            object.__setattr__(self, name, tuple(getattr(self, name)))
        whole(self, "acoustics", "masters", "quadrature_order", "singular_order", "gap_halvings")
        whole(self, "acoustics", "interpolation_points", "interpolation_poles", "solver_iterations")
        ratios, orders = self.close_distances, self.close_orders
        require(
            len(ratios) == len(orders) >= 1 and all(1 <= order <= 20 and is_whole(order) for order in orders),
            f"acoustics close_orders = {orders} must give a whole order of 1…20 for each of close_distances = {ratios}",
        )
        require(
            ratios[-1] >= 1.4 and all(low < high for low, high in pairwise(ratios)),
            f"acoustics close_distances = {ratios} must increase, to 1.4 at least: that far, triangles touch",
        )
        require(
            self.solver in SOLVERS,
            f"acoustics solver = {self.solver!r} is unknown: choose from {', '.join(SOLVERS)}",
        )
        require(
            self.radiation in RADIATIONS,
            f"acoustics radiation = {self.radiation!r} is unknown: choose from {', '.join(RADIATIONS)}",
        )
        require(
            self.precision in PRECISIONS,
            f"acoustics precision = {self.precision!r} is unknown: choose from {', '.join(PRECISIONS)}",
        )
