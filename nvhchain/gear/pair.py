"""A pair of external involute gears: working geometry and the plane of action.

The pinion drives and turns counter-clockwise about +z (sense +1) or clockwise (−1), the wheel the other way. Each
angle counts positive in its own running direction; r_bP φ_P = r_bG φ_G without load. On the plane of action
s is the distance from the pinion's base tangent point along the transverse line of action, z the distance from
mid-width. Drive flanks (of both gears: those that face the pinion's running direction), tooth pair k, wheel angle θ:

    s = s_C + r_bG θ − k p_bt + z tan β_b sense,     s_A ≤ s ≤ s_E,

so that pair 0 touches at the pitch point C at mid-width at θ = 0; β_b > 0 where the pinion is right-handed. The
back flanks meet on the mirrored line, with s measured from its own tangent point:

    s = s_C + (k + 1) p_bt − s_wG cos α_wt − r_bG θ − z tan β_b sense,

s_wG the wheel's tooth thickness on its working circle. Beyond the path of contact between the tip circles a tip edge
meets the mating flank: loaded teeth do so where the gap is small enough (`corner_gap`). The deflection (some 10 µm) is
left out of s against the base pitch (some mm).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import acos, cos, degrees, lcm, pi, sin, sqrt, tan

import numpy as np

from nvhchain.errors import InputError, require
from nvhchain.gear.body import GearBody
from nvhchain.gear.corner import edge_gap, extension
from nvhchain.gear.geometry import GearGeometry, involute
from nvhchain.gear.separation import Misalignment
from nvhchain.handoff import FloatArray, IntArray

DRIVE, BACK = 0, 1


@dataclass(frozen=True, eq=False)
class ContactLines:
    """Slices of all contact lines at one angle; one entry per slice that touches the path of contact.

    flank: DRIVE or BACK.  side: its index in `FlankCompliance`, 0 faces counter-clockwise.
    tooth: (2, n) index of pinion and wheel.
    axial: (n,) m, middle of the part in contact.  position: (n,) s, m.  length: (n,) m along the contact line.
    radius: (2, n) m, of the contact point on pinion and wheel.  depth: (2, n) m, from there along the normal to the
    tooth centre line.
    curvature: (n,) m, ρ₁ρ₂/(ρ₁+ρ₂) in the normal plane; of the end of the path where an edge touches.
    corner: (n,) m, gap along the normal by which an edge beyond the end of the path misses the flank; 0 on the path.
    """

    flank: int
    side: int
    tooth: IntArray
    axial: FloatArray
    position: FloatArray
    length: FloatArray
    radius: FloatArray
    depth: FloatArray
    curvature: FloatArray
    corner: FloatArray


@dataclass(frozen=True, eq=False)
class GearPair:
    """Pinion and wheel at a centre distance, m; the wheel's tooth 0 touches at the pitch point at wheel angle 0.

    sense: +1 where the pinion, driving, turns counter-clockwise about +z, −1 clockwise.
    misalignment: angles between the axes.
    Raises InputError for gears that cannot run together.
    """

    pinion: GearBody
    wheel: GearBody
    centre_distance: float
    sense: int = 1
    misalignment: Misalignment = Misalignment()  # noqa: RUF009 (frozen)

    def __post_init__(self) -> None:
        p, w, a = self.pinion.geometry, self.wheel.geometry, self.centre_distance
        require(self.sense in (1, -1), f"sense = {self.sense}: +1 (counter-clockwise about z) or -1")
        require(
            abs(p.normal_module * cos(p.normal_pressure_angle) / (w.normal_module * cos(w.normal_pressure_angle)) - 1)
            < 1e-6,
            f"base pitches differ: modules {1e3 * p.normal_module:g} and {1e3 * w.normal_module:g} mm, pressure angles "
            f"{degrees(p.normal_pressure_angle):g} and {degrees(w.normal_pressure_angle):g}°: give both gears the same",
        )
        require(
            abs(p.base_helix_angle + w.base_helix_angle) < 1e-6,
            f"helix angles {degrees(p.helix_angle):g} and {degrees(w.helix_angle):g}° do not mesh: "
            "give them opposite hands",
        )
        lowest = p.base_radius + w.base_radius
        require(
            a > lowest,
            f"centre_distance = {1e3 * a:g} mm is not beyond the base circles' {1e3 * lowest:g} mm: increase it",
        )
        for name, gear, other in (("pinion", p, w), ("wheel", w, p)):
            clearance = a - gear.tip_circle_radius - other.root_radius
            require(
                clearance >= 0,
                f"tip of the {name} reaches {-1e3 * clearance:.3g} mm into the mating root: increase centre_distance "
                "or reduce its addendum",
            )
        for name, gear, lowest_contact in (("pinion", p, self.path[0]), ("wheel", w, self.line_length - self.path[1])):
            limit = sqrt(max(gear.form_radius**2 - gear.base_radius**2, 0.0))
            require(
                lowest_contact >= limit,
                f"mating tip meets the {name} {1e3 * (limit - lowest_contact):.3g} mm below the start of its involute: "
                f"use more teeth, a larger profile_shift or a smaller mating addendum",
            )
        require(
            self.transverse_contact_ratio > 0 and self.total_contact_ratio >= 1,
            f"contact ratio {self.total_contact_ratio:.3f} is below 1: reduce centre_distance or increase the addenda",
        )
        require(
            self.backlash >= -1e-9,
            f"backlash is {1e6 * self.backlash:.1f} µm, the flanks jam: increase centre_distance "
            "or thickness_allowance",
        )

    @property
    def _geometries(self) -> tuple[GearGeometry, GearGeometry]:
        return self.pinion.geometry, self.wheel.geometry

    @cached_property
    def base_radius(self) -> FloatArray:
        """(2,) m, pinion and wheel."""
        return np.array([g.base_radius for g in self._geometries])

    @cached_property
    def working_pressure_angle(self) -> float:
        """α_wt, rad, transverse: cos α_wt = (r_bP + r_bG)/a."""
        return acos(float(self.base_radius.sum()) / self.centre_distance)

    @property
    def base_helix_angle(self) -> float:
        """β_b, rad, > 0 where the pinion is right-handed."""
        return self.pinion.geometry.base_helix_angle

    @property
    def face_width(self) -> float:
        """Common face width, m; both gears are centred on the same plane."""
        return min(g.face_width for g in self._geometries)

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt, m."""
        return 2 * pi * float(self.base_radius[1]) / self.wheel.geometry.teeth

    @property
    def line_length(self) -> float:
        """Distance between the base tangent points, a sin α_wt, m."""
        return self.centre_distance * sin(self.working_pressure_angle)

    @property
    def pitch_point(self) -> float:
        """s_C, m."""
        return float(self.base_radius[0]) * tan(self.working_pressure_angle)

    @cached_property
    def path(self) -> tuple[float, float]:
        """(s_A, s_E), m: where the wheel's tip and the pinion's tip cross the line of action."""
        p, w = self._geometries
        return (
            self.line_length - sqrt(w.tip_circle_radius**2 - w.base_radius**2),
            sqrt(p.tip_circle_radius**2 - p.base_radius**2),
        )

    def edge(self, gear: int) -> tuple[float, float, float, float, float]:
        """What `edge_gap` wants of the tip edge of the pinion (0) or the wheel (1)."""
        own, mating = (float(r) for r in self.base_radius[[gear, 1 - gear]])
        return own, mating, self._geometries[gear].tip_circle_radius, self.line_length, self.centre_distance

    def extensions(self, corner_gap: float) -> tuple[float, float]:
        """Lengths, m, before and after the path where tip edges miss the flank by less than `corner_gap`, m."""
        return extension(corner_gap, *self.edge(1)), extension(corner_gap, *self.edge(0))

    @property
    def transverse_contact_ratio(self) -> float:
        """ε_α."""
        return (self.path[1] - self.path[0]) / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """ε_β."""
        return self.face_width * abs(tan(self.base_helix_angle)) / self.base_pitch

    @property
    def total_contact_ratio(self) -> float:
        """ε_γ."""
        return self.transverse_contact_ratio + self.overlap_ratio

    @cached_property
    def _working_thickness(self) -> tuple[float, float]:
        """Tooth thickness of pinion and wheel on the working pitch circles, transverse arc, m."""
        radii = self.base_radius / cos(self.working_pressure_angle)
        p, w = (2 * r * float(g.half_tooth_angle(r)) for g, r in zip(self._geometries, radii, strict=True))
        return p, w

    @cached_property
    def backlash(self) -> float:
        """Normal backlash j_bn, m: what δ travels between the two flanks."""
        working_pitch = self.base_pitch / cos(self.working_pressure_angle)
        transverse = (working_pitch - sum(self._working_thickness)) * cos(self.working_pressure_angle)
        return transverse * cos(self.base_helix_angle)

    @property
    def mesh_period(self) -> float:
        """Wheel angle of one tooth, rad."""
        return 2 * pi / self.wheel.geometry.teeth

    @property
    def meshes_per_body_period(self) -> int:
        """Mesh periods after which the same sector positions of both blanks meet again."""
        return lcm(self.pinion.sector, self.wheel.sector)

    def normal_force(self, pinion_torque: float) -> float:
        """Force along the flank normal, N, that carries `pinion_torque`, N m: T/(r_bP cos β_b)."""
        return pinion_torque / (float(self.base_radius[0]) * cos(self.base_helix_angle))


def nominal_centre_distance(pinion: GearGeometry, wheel: GearGeometry) -> float:
    """Centre distance, m, at which gears without thickness allowance run free of backlash.

    inv α_wt = inv α_t + 2 tan α_n (x₁ + x₂)/(z₁ + z₂).  Raises InputError when there is none.
    """
    alpha = pinion.transverse_pressure_angle
    target = float(involute(alpha)) + 2 * tan(pinion.normal_pressure_angle) * (
        pinion.profile_shift + wheel.profile_shift
    ) / (pinion.teeth + wheel.teeth)
    require(
        0 < target < 2,
        f"profile shifts {pinion.profile_shift:g} and {wheel.profile_shift:g} leave no working pressure angle: "
        "bring their sum closer to zero",
    )
    working = (3 * target) ** (1 / 3)
    for _ in range(100):
        change = (float(involute(working)) - target) / tan(working) ** 2
        working -= change
        if abs(change) < 1e-14:
            return (pinion.base_radius + wheel.base_radius) / cos(working)
    raise InputError(f"no working pressure angle found for inv α = {target:g}")


def contact_lines(
    pair: GearPair, angle: float, *, slices: int, flank: int = DRIVE, corner_gap: float = 0.0
) -> ContactLines:
    """Contact lines of all tooth pairs at wheel `angle`, rad, cut into `slices` over the common face width.

    corner_gap: m, unloaded gap up to which tip edges beyond the path count as in contact.
    A slice that is crossed by an end of the path keeps the part inside it, so lengths vary continuously for
    helical gears. Tooth indices count counter-clockwise in each gear's own numbering and are not reduced modulo z.
    """
    tangent, width, pitch = pair.sense * tan(pair.base_helix_angle), pair.face_width, pair.base_pitch
    before, after = pair.extensions(corner_gap)
    start, end = pair.path[0] - before, pair.path[1] + after
    travel = float(pair.base_radius[1]) * angle
    if flank == DRIVE:
        direction, origin = 1.0, pair.pitch_point + travel
    else:
        lag = pair._working_thickness[1] * cos(pair.working_pressure_angle)
        direction, origin = -1.0, pair.pitch_point + pitch - lag - travel
    reach = abs(tangent) * width / 2
    low, high = (origin - reach - end) / pitch, (origin + reach - start) / pitch
    count = np.arange(np.ceil(low), np.floor(high) + 1)
    k = (direction * count).astype(np.int64)
    middle = origin - count * pitch

    edges = np.linspace(-width / 2, width / 2, slices + 1)
    slope = direction * tangent
    if slope != 0.0:
        bounds = np.sort(np.stack([(start - middle) / slope, (end - middle) / slope]), axis=0)
    else:
        inside = (middle >= start) & (middle < end)
        bounds = np.where(inside, np.array([[-width], [width]]), 0.0)
    lower = np.maximum(edges[:-1], bounds[0][:, None])
    upper = np.minimum(edges[1:], bounds[1][:, None])
    pairs, cuts = np.nonzero(upper - lower > 1e-9 * width)
    lower, upper = lower[pairs, cuts], upper[pairs, cuts]
    axial = (lower + upper) / 2
    position = middle[pairs] + slope * axial
    length = (upper - lower) / cos(pair.base_helix_angle)

    on_path = np.clip(position, *pair.path)
    distances = np.stack([on_path, pair.line_length - on_path])
    radius = np.hypot(distances, pair.base_radius[:, None])
    corner = _touch_edges(pair, position, radius) if corner_gap else np.zeros(len(position))
    wheel_tooth = k[pairs] + (1 if flank == BACK else 0)
    depth = np.stack([g.depth_to_centre_line(r) for g, r in zip(pair._geometries, radius, strict=True)])
    return ContactLines(
        flank=flank,
        side=flank if pair.sense > 0 else 1 - flank,
        tooth=pair.sense * np.stack([-k[pairs], wheel_tooth]),
        axial=axial,
        position=position,
        length=length,
        radius=radius,
        depth=depth,
        curvature=distances[0] * distances[1] / (pair.line_length * cos(pair.base_helix_angle)),
        corner=corner,
    )


def _touch_edges(pair: GearPair, position: FloatArray, radius: FloatArray) -> FloatArray:
    """Gaps (n,) m of the slices beyond the path; their place on the flank goes into `radius` (2, n) m."""
    gap = np.zeros(len(position))
    for edge, beyond in ((1, pair.path[0] - position), (0, position - pair.path[1])):
        at = np.flatnonzero(beyond > 0)
        arc, met = edge_gap(beyond[at], *pair.edge(edge))
        gap[at] = arc * cos(pair.base_helix_angle)
        radius[1 - edge, at] = met
    return gap


def separation(pair: GearPair, lines: ContactLines) -> FloatArray:
    """(n,) m: unloaded gap of every slice beyond that of aligned pure involutes; negative where misalignment closes it.

    What micro-geometry takes off both flanks, the misalignment, and what an edge beyond the path misses.
    """
    drive = lines.flank == DRIVE
    gap = pair.misalignment.separation(
        lines.position - pair.pitch_point,
        lines.axial,
        drive=drive,
        sense=pair.sense,
        pressure_angle=pair.working_pressure_angle,
        tilt=pair.base_helix_angle,
    )
    gap = gap + lines.corner
    for gear, radius in zip(pair._geometries, lines.radius, strict=True):
        gap = gap + gear.removed(radius, lines.axial, drive=drive)
    return gap
