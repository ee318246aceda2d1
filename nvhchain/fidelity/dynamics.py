"""Knobs of the time integration of the gearbox."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.errors import require
from nvhchain.fidelity.limits import whole, within

MESH_LEVELS = ("table", "contact")
"""Models of a gear mesh in the time loop, the simplest first."""


@dataclass(frozen=True)
class DynamicsFidelity:
    """Time integration of the gearbox.

    time_step: s, largest step of the integrator; 10 µs are right within 1e-4 of the peak while flanks stay in contact
    at the usual speeds (4e-4 at 10 000 rpm), 1 µs where they part and strike under load, or 5 µs with bent_ways;
    lightly loaded flanks that fly far want 0.25 µs, or 2 µs (docs/measured/dynamics/cuts.md).
    settle_level: what is left of the start when recording begins, relative to the swing of the bearing forces.
    settle_time: s allowed for that.
    samples_per_period: steps that the shortest period of the band must have.
    angle_refinement: interpolated rows per tabulated angle of a mesh law.  contact_residual: admissible residual of the
    mesh forces in a step, relative to the largest tabulated force; reached within contact_iterations.
    stored_samples_per_period: samples of a run-up's record in the shortest period of the band, at least.
    stopband_attenuation: dB by which what would fold back into the band is lowered before a run-up is thinned out.
    mesh_level: `table`, the mesh law F(θ, δ); `contact`, the contact problem itself at every step (slow: the yardstick
    of the table).
    face_points: of a mesh across its face, at which it carries: one, at mid-width, or more, which feel the tilt of the
    gears.
    gyroscopic: whether the shafts' spin turns their tilting.  gyroscopic_speeds: at which the modes are taken along a
    run-up.
    flexible_shafts: whether shafts bend and twist (Timoshenko beams).  shaft_element: m, largest length of a beam
    element.  shaft_frequency: Hz, up to which modes of the free shafts are kept; beyond it their statics is.
    bent_ways: whether the mean mesh force of a step takes the bend of its way and its rise, for flanks that part and
    strike: errors there fall by ten and more, but energy is no longer exact, so that steps are refused in which small
    motions would grow for want of damping, and the meshes limit the step.
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
    face_points: int = 1
    gyroscopic: bool = False
    gyroscopic_speeds: int = 16
    flexible_shafts: bool = False
    shaft_element: float = 10e-3
    shaft_frequency: float = 10e3
    bent_ways: bool = False

    def __post_init__(self) -> None:
        within(
            self,
            "dynamics",
            ("time_step", 1e-9, 1e-2),
            ("settle_level", 1e-12, 0.5),
            ("settle_time", 0.0, 1e5),
            ("samples_per_period", 2.0, 1e4),
            ("angle_refinement", 1, 64),
            ("contact_residual", 1e-15, 1e-3),
            ("contact_iterations", 0, 10_000),
            ("stored_samples_per_period", 2.56, 1e4),
            ("stopband_attenuation", 20.0, 200.0),
            ("face_points", 1, 16),
            ("gyroscopic_speeds", 1, 1000),
            ("shaft_element", 1e-4, 1.0),
            ("shaft_frequency", 0.0, 1e6),
        )
        whole(self, "dynamics", "angle_refinement", "contact_iterations", "face_points", "gyroscopic_speeds")
        require(
            self.mesh_level in MESH_LEVELS,
            f"dynamics mesh_level = {self.mesh_level!r} is unknown: choose from {', '.join(MESH_LEVELS)}",
        )
