"""Every accuracy knob: one frozen class per stage and three presets.

A fidelity value changes how close the answer is; a case value changes what the answer is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from nvhchain.errors import require

SOLVERS = ("auto", "direct", "iterative", "compressed")
"""Ways to solve boundary element systems."""

INTERPOLATIONS = ("rational", "phase_removed", "linear")
"""Ways to go from master frequencies to a line between them."""

RADIATIONS = ("boundary_elements", "rayleigh", "equivalent_radiated_power")
"""Ways to go from surface velocity to sound, the exact one first."""

MESH_LEVELS = ("stiffness", "table", "contact")
"""Models of a gear mesh in the time loop, the simplest first."""


PRECISIONS = ("double", "single")
"""Widths of the boundary element matrices: 16 and 8 bytes per entry."""

BODIES = ("elements", "analytic")
"""Ways to find how teeth and blanks give way."""


@dataclass(frozen=True)
class GearFidelity:
    """Finite element body, contact slices and the grid of the mesh law.

    profile_elements: quadratic elements along one flank.  width_layers: element layers over the face width.
    transverse_refinement: factor on the elements across tooth and rim (1: four across the tooth).
    row_aspect: radial over circumferential size of the blank's elements under the teeth.
    root_refinement: the same factor for the mesh in which root strain is read, of one tooth.
    load_pattern_tolerance: what is neglected of the forces a tooth passes to the body, relative.
    corner_gap: m, unloaded gap up to which contact of tip edges beyond the path of contact is looked for; 0: none.
    A fixed length: the default holds for the gearbox stages, of steel, up to three times their nominal load
    (docs/decisions/0008.md). Where deflections are larger (heavier loads, aluminium, plastics) edges that would close
    are left out and the mesh is too soft, by 4 % for a steel spur pair at 3500 N m: give at least the deflection.
    bodies: how teeth and blanks give way, `elements` or, for a first look, `analytic` (Weber–Banaschek beam on
    Sainsot–Velex ring; it sees no web, hole or slot).
    far_pattern_tolerance: what of them is taken to answer alike at all teeth of a sector, relative.
    slices: axial slices of a contact line.  angles_per_mesh: mesh-law angles per mesh period.
    deflections: mesh-law deflections.  contact_residual: admissible residual of the complementarity
    problem, relative to the deflection scale.  drive_reach, back_reach: mesh-law forces on the drive and back flank,
    times the nominal force.
    """

    profile_elements: int
    width_layers: int
    slices: int
    angles_per_mesh: int
    deflections: int
    contact_residual: float = 1e-10
    transverse_refinement: int = 1
    row_aspect: float = 1.5
    load_pattern_tolerance: float = 1e-3
    far_pattern_tolerance: float = 3e-2
    bodies: str = "elements"
    corner_gap: float = 60e-6
    drive_reach: float = 3.0
    back_reach: float = 1.5
    root_refinement: int = 4

    def __post_init__(self) -> None:
        for name, low, high in (
            ("profile_elements", 1, 100),
            ("width_layers", 1, 200),
            ("slices", 1, 2000),
            ("angles_per_mesh", 2, 10_000),
            ("deflections", 6, 1000),
            ("contact_residual", 1e-13, 1e-4),
            ("transverse_refinement", 1, 16),
            ("root_refinement", 1, 16),
            ("row_aspect", 0.1, 10.0),
            ("load_pattern_tolerance", 0.0, 0.1),
            ("far_pattern_tolerance", 0.0, 0.5),
            ("drive_reach", 0.1, 100.0),
            ("back_reach", 0.1, 100.0),
            ("corner_gap", 0.0, 1e-3),
        ):
            value = getattr(self, name)
            require(low <= value <= high, f"gear {name} = {value} is outside {low:g}…{high:g}")
        require(self.bodies in BODIES, f"gear bodies = {self.bodies!r} is unknown: choose from {', '.join(BODIES)}")


@dataclass(frozen=True)
class DynamicsFidelity:
    """Time integration of the gearbox.

    time_step: s, largest step of the integrator.  settle_level: what is left of the start when recording begins,
    relative to the swing of the bearing forces.  settle_time: s allowed for that.
    samples_per_period: steps that the shortest period of the band must have.
    angle_refinement: interpolated rows per tabulated angle of a mesh law.  contact_residual: admissible residual of the
    mesh forces in a step, relative to the largest tabulated force; reached within contact_iterations.
    stored_samples_per_period: samples of a run-up's record in the shortest period of the band, at least.
    stopband_attenuation: dB by which what would fold back into the band is lowered before a run-up is thinned out.
    mesh_level: `table`, the mesh law F(θ, δ); `stiffness`, its tangent k(θ) at the nominal force, without a gap;
    `contact`, the contact problem itself at every step (slow: the yardstick of the others).
    contact_loss: whether at the level `stiffness` flanks part, with the law's backlash, instead of pulling.
    edge_cells: of deflection, over which the ends of the gap are resolved where contact_loss is set.
    face_points: of a mesh across its face, at which it carries: one, at mid-width, or more, which feel the tilt of the
    gears.
    gyroscopic: whether the shafts' spin turns their tilting.  gyroscopic_speeds: at which the modes are taken along a
    run-up.
    flexible_shafts: whether shafts bend and twist (Timoshenko beams).  shaft_element: m, largest length of a beam
    element.  shaft_frequency: Hz, up to which modes of the free shafts are kept; beyond it their statics is.
    """

    time_step: float
    settle_level: float = 1e-6
    settle_time: float = 20.0
    samples_per_period: float = 8.0
    angle_refinement: int = 4
    contact_residual: float = 1e-12
    contact_iterations: int = 100
    stored_samples_per_period: float = 5.0
    stopband_attenuation: float = 100.0
    mesh_level: str = "table"
    contact_loss: bool = False
    edge_cells: int = 64
    face_points: int = 1
    gyroscopic: bool = False
    gyroscopic_speeds: int = 16
    flexible_shafts: bool = False
    shaft_element: float = 10e-3
    shaft_frequency: float = 10e3

    def __post_init__(self) -> None:
        for name, low, high in (
            ("time_step", 1e-9, 1e-2),
            ("settle_level", 1e-12, 0.5),
            ("settle_time", 0.0, 1e5),
            ("samples_per_period", 2.0, 1e4),
            ("angle_refinement", 1, 64),
            ("contact_residual", 1e-15, 1e-3),
            ("contact_iterations", 0, 10_000),
            ("stored_samples_per_period", 2.56, 1e4),
            ("stopband_attenuation", 20.0, 200.0),
            ("edge_cells", 1, 10_000),
            ("face_points", 1, 16),
            ("gyroscopic_speeds", 1, 1000),
            ("shaft_element", 1e-4, 1.0),
            ("shaft_frequency", 0.0, 1e6),
        ):
            value = getattr(self, name)
            require(low <= value <= high, f"dynamics {name} = {value} is outside {low:g}…{high:g}")
        require(
            self.mesh_level in MESH_LEVELS,
            f"dynamics mesh_level = {self.mesh_level!r} is unknown: choose from {', '.join(MESH_LEVELS)}",
        )
        require(
            not self.contact_loss or self.mesh_level == "stiffness",
            f"dynamics contact_loss belongs to the mesh level `stiffness`; at {self.mesh_level!r} flanks part anyhow",
        )


@dataclass(frozen=True)
class HousingFidelity:
    """Mesh of the casting, modes and the transfer of its motion to the radiating surface.

    element_size: m, quadratic tetrahedra.  mode_ratio: modes up to this multiple of the band's upper limit.
    truncation_tolerance_db: dB of surface velocity that may be lost with the modes left out, in the mean over the upper
    three octaves of the band and at the four lines that the provenance states, by the housing's own estimate; the
    fewest modes that keep to it are taken, never fewer than the band holds, looked for from mode_ratio up; 0:
    mode_ratio alone decides.
    elements_per_turn: around bores and other round edges.  elements_per_bending_wavelength: fewest that are accepted
    in the wall at the upper band limit.  samples_per_face: points per edge of a radiating face at which the motion of
    the skin is collected.  voxels_per_face: of the grid in which the envelope of a foreign mesh is found, per edge of a
    radiating face.  mapping_tolerance_db: dB by which the radiating faces may miss the sound power of the skin they
    stand for before it is warned of.
    residual_flexibility: whether the modes left out move statically, or not at all.
    """

    element_size: float
    mode_ratio: float = 1.25
    elements_per_turn: float = 16.0
    elements_per_bending_wavelength: float = 4.0
    samples_per_face: float = 6.0
    voxels_per_face: float = 5.0
    mapping_tolerance_db: float = 1.0
    truncation_tolerance_db: float = 0.0
    residual_flexibility: bool = True

    def __post_init__(self) -> None:
        for name, low, high in (
            ("element_size", 1e-5, 1.0),
            ("mode_ratio", 0.1, 20.0),
            ("elements_per_turn", 0.0, 1000.0),
            ("elements_per_bending_wavelength", 0.1, 100.0),
            ("samples_per_face", 0.5, 100.0),
            ("voxels_per_face", 1.0, 100.0),
            ("mapping_tolerance_db", 0.0, 100.0),
            ("truncation_tolerance_db", 0.0, 20.0),
        ):
            value = getattr(self, name)
            require(low <= value <= high, f"housing {name} = {value} is outside {low:g}…{high:g}")


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
        separated pairs on bodies of 0.2 m: docs/measured/quadrature.md).
    close_orders: Gauss orders of pairs nearer than the matching close_distances, which count the distance of the
        centroids in longest edges of the larger triangle.
    gap_ratio, gap_halvings: triangles that face each other across less than this multiple of the longer one are cut
        until their pieces do not, at most this number of times.
    singular_order: Gauss order per direction of pairs that share a corner, an edge or all.
    needle_aspect: triangles longer than this multiple of their height take twice that order, beyond its square thrice.
    precision: of the matrices and of well separated pairs, `double` or `single` (half the memory).
    field_near_ratio: a triangle longer than this multiple of its distance from a field point is subdivided.
    solver: of the dense systems, `direct` (LU factors) or `iterative` (GMRES), `compressed` (GMRES on compressed
        matrices), or `auto`, the cheapest that fits into memory.
    solver_residual: of an iterative solution, relative to the right-hand side, reached within solver_iterations; a
        tenth of compression_error is enough for compressed matrices.
    compression_error: of the compressed matrices, relative (Frobenius norm, in every group of rows).
    coarse_edge_ratios: lengths of the edges of coarser surfaces for lower frequencies, relative to the given surface;
        none: every frequency on the given one.  coarse_elements_per_wavelength: of a coarser surface, at the highest
        frequency it is used for.  Monopole and dipole parts of a motion keep to the error that the provenance states
        (coarse_error_dB); parts that cancel within a few coarse edges lose more, the more the lower the frequency: at
        ka = 0.09 a sphere of 1280 faces errs at ratio 2 by 1.4 % (l = 1), 4.3 % (2) and 21 % (3), at ratio 1.4 by 0.7,
        2 and 8 %, of the peak.  Transfer vectors alone take them, not sound power (docs/measured/sound_power.md).
    multipole_digits: decimal digits to which sound power resolves the spherical waves that leave the surface.
    radiation: `boundary_elements`, or a cheaper level (docs/measured/radiation.md): `rayleigh`, every visible face in
        an infinite baffle, or `equivalent_radiated_power`, plane waves from every face, which knows no phase.
    interpolation: between masters: `rational` functions or polynomials (`phase_removed`) of the vectors without their
        phase, or `linear` (both for comparison).
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
    coarse_edge_ratios: tuple[float, ...] = ()
    coarse_elements_per_wavelength: float = 6.0
    multipole_digits: float = 4.0
    radiation: str = "boundary_elements"
    interpolation: str = "rational"
    interpolation_points: int = 8
    interpolation_poles: int = 6
    master_tolerance_db: float = 0.1

    def __post_init__(self) -> None:
        for name in ("close_distances", "close_orders", "coarse_edge_ratios"):
            # lists cannot be hashed, and what is computed once per surface is kept by the knobs
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name, low, high in (
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
            ("coarse_elements_per_wavelength", 2.0, 100.0),
            ("interpolation_poles", 1, 14),
            ("multipole_digits", 1.0, 12.0),
            ("master_tolerance_db", 1e-4, 20.0),
            ("solver_residual", 1e-13, 1e-2),
            ("solver_iterations", 1, 10_000),
            ("compression_error", 1e-7, 1e-2),
        ):
            value = getattr(self, name)
            require(low <= value <= high, f"acoustics {name} = {value} is outside {low:g}…{high:g}")
        ratios, orders = self.close_distances, self.close_orders
        require(
            len(ratios) == len(orders) >= 1 and all(1 <= order <= 20 for order in orders),
            f"acoustics close_orders = {orders} must give an order of 1…20 for each of close_distances = {ratios}",
        )
        require(
            ratios[-1] >= 1.4 and all(low < high for low, high in pairwise(ratios)),
            f"acoustics close_distances = {ratios} must increase, to 1.4 at least: that far, triangles touch",
        )
        require(
            self.solver in SOLVERS,
            f"acoustics solver = {self.solver!r} is unknown: choose from {', '.join(SOLVERS)}",
        )
        ratios = self.coarse_edge_ratios
        require(
            all(1.0 < ratio <= 20.0 for ratio in ratios),
            f"acoustics coarse_edge_ratios = {ratios} must lie between 1 and 20: coarser than the given surface",
        )
        require(
            self.radiation in RADIATIONS,
            f"acoustics radiation = {self.radiation!r} is unknown: choose from {', '.join(RADIATIONS)}",
        )
        require(
            self.precision in PRECISIONS,
            f"acoustics precision = {self.precision!r} is unknown: choose from {', '.join(PRECISIONS)}",
        )
        require(
            self.interpolation in INTERPOLATIONS,
            f"acoustics interpolation = {self.interpolation!r} is unknown: choose from {', '.join(INTERPOLATIONS)}",
        )


@dataclass(frozen=True)
class LumpedFidelity:
    """Gear pairs with one degree of freedom: time integration and harmonic balance; not part of the chain.

    time_step: s, of the Runge–Kutta integration, at most.  steps_per_period: fewest steps of a natural period and of a
    mesh cycle.  settle_time: s at each speed of a sweep before it is measured.  settle_level: what may be left then of
    a disturbance, relative, as linear damping has it die out.  body_periods: measured at each speed.
    harmonics, harmonic_samples: of the balance, per mesh cycle of the body period.  residual: admissible, relative to
    the load, reached within newton_iterations.  arc_step: largest step along the curve, in units of static deflection
    and natural frequency.  arc_points: most points of a curve.
    """

    time_step: float = 2e-6
    steps_per_period: float = 20.0
    settle_time: float = 0.02
    settle_level: float = 1e-6
    body_periods: int = 1
    harmonics: int = 32
    harmonic_samples: int = 1024
    residual: float = 1e-9
    newton_iterations: int = 20
    arc_step: float = 0.02
    arc_points: int = 5000

    def __post_init__(self) -> None:
        for name, low, high in (
            ("time_step", 1e-12, 1.0),
            ("steps_per_period", 8.0, 1e6),
            ("settle_time", 0.0, 1e4),
            ("settle_level", 1e-15, 1.0),
            ("body_periods", 1, 100_000),
            ("harmonics", 1, 1000),
            ("harmonic_samples", 8, 100_000),
            ("residual", 1e-14, 1e-3),
            ("newton_iterations", 2, 1000),
            ("arc_step", 1e-6, 1.0),
            ("arc_points", 10, 10_000_000),
        ):
            value = getattr(self, name)
            require(low <= value <= high, f"lumped {name} = {value} is outside {low:g}…{high:g}")


LUMPED = LumpedFidelity()
"""For the studies of single gear pairs, which cost seconds: the same in every preset."""


@dataclass(frozen=True)
class Fidelity:
    """One preset: a name and a knob set per stage."""

    name: str
    gear: GearFidelity
    dynamics: DynamicsFidelity
    housing: HousingFidelity
    acoustics: AcousticsFidelity


DRAFT = Fidelity(
    "draft",
    GearFidelity(
        profile_elements=4,
        width_layers=8,
        slices=16,
        angles_per_mesh=48,
        deflections=16,
        row_aspect=2.5,
        load_pattern_tolerance=3e-3,
        far_pattern_tolerance=0.1,
    ),
    DynamicsFidelity(time_step=20e-6),
    HousingFidelity(element_size=0.013),
    AcousticsFidelity(elements_per_wavelength=3.0, masters=64, master_tolerance_db=0.5),
)
STANDARD = Fidelity(
    "standard",
    GearFidelity(profile_elements=4, width_layers=10, slices=32, angles_per_mesh=96, deflections=24),
    DynamicsFidelity(time_step=10e-6),
    HousingFidelity(element_size=0.0105, mode_ratio=1.4),
    AcousticsFidelity(elements_per_wavelength=4.5, masters=128),
)
REFERENCE = Fidelity(
    "reference",
    GearFidelity(
        profile_elements=10,
        width_layers=12,
        slices=48,
        angles_per_mesh=192,
        deflections=40,
        row_aspect=1.0,
        load_pattern_tolerance=3e-4,
        far_pattern_tolerance=0.01,
    ),
    DynamicsFidelity(time_step=5e-6),
    HousingFidelity(element_size=0.009, mode_ratio=1.6),
    AcousticsFidelity(
        elements_per_wavelength=5.0,
        masters=256,
        master_tolerance_db=0.02,
        quadrature_order=4,
        close_distances=(1.5, 3.0, 6.0),
        close_orders=(8, 6, 4),
        singular_order=5,
        coarsest_elements_per_wavelength=4.0,
    ),
)
PRESETS = {preset.name: preset for preset in (DRAFT, STANDARD, REFERENCE)}
