"""Contact lines of a gear pair on its plane of action, and friction along them.

The pinion drives and turns counter-clockwise about +z (sense +1) or clockwise (−1), the wheel the other way.  Each
angle counts positive in its own running direction; r_bP φ_P = r_bG φ_G without load.

On the plane of action, s is the distance from the pinion's base tangent point along the transverse line of action. z is
the distance from mid-width.  Drive flanks are those of both gears that face the pinion's running direction.  For the
drive flanks, tooth pair k and wheel angle θ,

    s = s_C + r_bG θ − k p_bt + z tan β_b sense,     s_A ≤ s ≤ s_E,

so that pair 0 touches at the pitch point C at mid-width at θ = 0; β_b > 0 where the pinion is right-handed.  The back
flanks meet on the mirrored line, with s measured from its own tangent point:

    s = s_C + (k + 1) p_bt − s_wG cos α_wt − r_bG θ − z tan β_b sense,

with s_wG the wheel's tooth thickness on its working circle.

Beyond the path of contact between the tip circles a tip edge meets the mating flank.  Under load edges with a gap up to
`corner_gap` are included.

The deflection (some 10 µm) is neglected in s against the base pitch (some mm).

Friction is Coulomb's. With parallel axes the flanks slide in the transverse plane, across the line of action. At s from
the pinion's base tangent point the pinion's flank moves with ω_P s and the wheel's with ω_G (L − s). L is the distance
of the tangent points. The friction force μ F reverses with the sliding velocity at the pitch point.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, tan

import numpy as np

from nvhchain.errors import require_within
from nvhchain.gear.contact.local_law import TipEdges
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair, edge_gap
from nvhchain.handoff import FloatArray, IntArray

LARGEST_COEFFICIENT = 1.0
"""Largest coefficient of friction; a larger value has a wrong unit."""


POINTS, ZOOMS = 17, 4
"""Points along the profile, and number of refinements, of the search for the least distance of relieved flanks. Each
refinement searches between the neighbours of the best point. The result is exact to 1e-4 of the range, some 0.1 µm."""


@dataclass(frozen=True, eq=False)
class ContactLines:
    """Slices of all contact lines at one wheel angle; one entry per slice that touches the path of contact.

    flank: DRIVE or BACK.
    side: index of the flank in `FlankCompliance`; 0 faces counter-clockwise.
    tooth (2, n): tooth of pinion and wheel.
    axial (n,): middle of the part in contact (m).
    position (n,): position s on the line of action (m).
    length (n,): length along the contact line (m).
    radius (2, n): radius of the contact point on pinion and wheel (m).
    depth (2, n): depth from the contact point along the normal to the tooth's centre line (m).
    curvature (n,): radius of relative curvature ρ₁ρ₂/(ρ₁+ρ₂) in the normal plane (m).
    corner (n,): gap along the normal between an edge beyond the end of the path and the flank (m); 0 on the path.
    edges: tip edges of both gears near the slices.
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
    edges: TipEdges


def contact_lines(
    pair: GearPair, angle: float, *, slices: int, flank: int = DRIVE, corner_gap: float = 0.0
) -> ContactLines:
    """Return the contact lines of all tooth pairs at one wheel angle, cut into slices over the common face width.

    angle: wheel angle (rad).
    corner_gap: unloaded gap up to which tip edges beyond the path count as in contact (m).

    A slice crossed by an end of the path keeps the part inside it.  Lengths therefore vary continuously for helical
    gears. Tooth indices count counter-clockwise in each gear's own numbering and are not reduced modulo z.
    """
    tangent, width, pitch = pair.sense * tan(pair.base_helix_angle), pair.face_width, pair.base_pitch
    before, after = pair.extensions(corner_gap)
    start, end = pair.path[0] - before, pair.path[1] + after
    travel = float(pair.base_radius[1]) * angle
    if flank == DRIVE:
        direction, origin = 1.0, pair.pitch_point + travel
    else:
        lag = pair.working_thickness[1] * cos(pair.working_pressure_angle)
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

    path_position = np.clip(position, *pair.path)
    radius = np.hypot(np.stack([path_position, pair.line_length - path_position]), pair.base_radius[:, None])
    corner, enclosed = _touch_edges(pair, position, radius)
    tip_circles = np.array([[g.tip_form_radius] for g in pair.geometries])
    there = np.flatnonzero((radius <= tip_circles * (1 + 1e-9)).all(axis=0))  # edges past the other tip are dropped
    axial, position, length, corner, enclosed = (a[there] for a in (axial, position, length, corner, enclosed))
    pairs, radius = pairs[there], radius[:, there]
    rolled = np.sqrt(radius**2 - pair.base_radius[:, None] ** 2)
    curvature = rolled[0] * rolled[1] / (rolled.sum(axis=0) * cos(pair.base_helix_angle))
    tips = np.array([[g.usable_flank[1]] for g in pair.geometries])
    distance = np.maximum(tips**2 - rolled**2, 0.0) / (2 * pair.base_radius[:, None])
    enclosed = np.where(enclosed > 0, enclosed, -distance.min(axis=0) / curvature)
    lean = np.array([g.tip_chamfer_angle if g.tip_chamfer else 0.5 * np.pi for g in pair.geometries])
    wedge = np.pi - lean + np.arctan(tips[:, 0] / pair.base_radius)
    wheel_tooth = k[pairs] + (1 if flank == BACK else 0)
    depth = np.stack([g.depth_to_centre_line(r) for g, r in zip(pair.geometries, radius, strict=True)])
    return ContactLines(
        flank=flank,
        side=flank if pair.sense > 0 else 1 - flank,
        tooth=pair.sense * np.stack([-k[pairs], wheel_tooth]),
        axial=axial,
        position=position,
        length=length,
        radius=radius,
        depth=depth,
        curvature=curvature,
        corner=corner,
        edges=TipEdges(distance, enclosed, wedge),
    )


def wheel_angle(pair: GearPair, position: float, axial: float, mesh: int, flank: int = DRIVE) -> float:
    """Return the wheel angle (rad) at which tooth pair `mesh` touches at `position` s and `axial` z (m)."""
    helix = pair.sense * tan(pair.base_helix_angle) * axial
    if flank == DRIVE:
        travel = position - pair.pitch_point + mesh * pair.base_pitch - helix
    else:
        lag = pair.working_thickness[1] * cos(pair.working_pressure_angle)
        travel = pair.pitch_point + (mesh + 1) * pair.base_pitch - lag - position - helix
    return travel / float(pair.base_radius[1])


def mesh_order(pair: GearPair, lines: ContactLines) -> IntArray:
    """Return the teeth (2, n) of pinion and wheel in the order in which they come into mesh."""
    return np.asarray(lines.tooth * np.array([[-pair.sense], [pair.sense]]))


def wheel_angles(pair: GearPair, lines: ContactLines) -> FloatArray:
    """Return the wheel angle (n,) in rad of contact lines, which every slice states up to rounding."""
    mesh = mesh_order(pair, lines)[0]
    turned = lines.position - pair.pitch_point, pair.sense * tan(pair.base_helix_angle) * lines.axial
    if lines.flank == DRIVE:
        travel = turned[0] + mesh * pair.base_pitch - turned[1]
    else:
        lag = pair.working_thickness[1] * cos(pair.working_pressure_angle)
        travel = (mesh + 1) * pair.base_pitch - lag - turned[0] - turned[1]
    return np.asarray(travel / float(pair.base_radius[1]))


def _touch_edges(pair: GearPair, position: FloatArray, radius: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return gaps (m) and angles between the flanks (rad) in the normal plane at slices beyond the path; 0 on it.

    Shapes are (n,).  The contact radius on the mating flank is written into `radius` (2, n), m.
    """
    gap, angle = np.zeros(len(position)), np.zeros(len(position))
    for edge, excess in ((1, pair.path[0] - position), (0, position - pair.path[1])):
        corner_slices = np.flatnonzero(excess > 0)
        arc, met, turned = edge_gap(excess[corner_slices], *pair.edge(edge))
        gap[corner_slices] = arc * cos(pair.base_helix_angle)
        angle[corner_slices] = turned * cos(pair.base_helix_angle)
        radius[1 - edge, corner_slices] = met
    return gap, angle


def separation(pair: GearPair, lines: ContactLines) -> FloatArray:
    """Return the unloaded gap (n,) in m of every slice beyond that of aligned pure involutes.

    The gap includes the material removed from both flanks where they come nearest, the misalignment, and the gap of
    edges beyond the path.  It is negative where misalignment closes the flanks.
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
    removed = np.zeros(len(gap))
    for gear, radius, face_position in zip(
        pair.geometries, lines.radius, pair.face_positions(lines.axial), strict=True
    ):
        removed = removed + gear.removed(radius, face_position, drive=drive)
    if any((g.micro.drive if drive else g.micro.coast).bends_profile for g in pair.geometries):
        removed = np.minimum(removed, _least_removed(pair, lines, removed))
    return np.asarray(gap + removed)


def _least_removed(pair: GearPair, lines: ContactLines, removed: FloatArray) -> FloatArray:
    """Return the least distance (n,) in m of both flanks over the profile: removed material plus distance of involutes.

    t (m) counts along the profile from the contact point of the involutes, towards the wheel's tip.  The wheel's
    squared rolled length grows by 2 r_b t and the pinion's falls by as much.  Involutes part by t²/(2ρ), beyond an edge
    by φ|t| more.  Relieved flanks touch further inside, where less is removed.

    removed: (n,) m, at t = 0.  Places where the involutes part by more than that cannot be nearer.
    """
    base = pair.base_radius[:, None, None]
    rolled = (lines.radius**2 - pair.base_radius[:, None] ** 2)[:, None]
    flanks = np.array([g.usable_flank for g in pair.geometries])
    inward = np.maximum(rolled[:, 0] - flanks[:, :1] ** 2, 0.0) / (2 * base[:, 0])
    reach = np.sqrt(2 * lines.curvature * removed)
    low = -np.minimum(np.minimum(lines.edges.distance[0], inward[1]), reach)
    high = np.minimum(np.minimum(lines.edges.distance[1], inward[0]), reach)
    angle = np.where(lines.corner > 0, np.maximum(lines.edges.angle, 0.0), 0.0)
    everywhere, faces = np.arange(len(removed)), pair.face_positions(lines.axial)
    for _ in range(ZOOMS):
        t = low + np.linspace(0.0, 1.0, POINTS)[:, None] * (high - low)
        parted = t**2 / (2 * lines.curvature) + angle * np.abs(t)
        for gear, squared, own, face_position, sign in zip(
            pair.geometries, rolled, pair.base_radius, faces, (-1.0, 1.0), strict=True
        ):
            radius = np.sqrt(own**2 + squared + sign * 2 * own * t)
            parted = parted + gear.removed(radius, face_position, drive=lines.flank == DRIVE)
        best = parted.argmin(axis=0)
        low, high = (t[np.clip(best + step, 0, POINTS - 1), everywhere] for step in (-1, 1))
    return np.asarray(parted.min(axis=0))


def check_coefficient(friction: float) -> None:
    """Refuse a coefficient of friction outside its range."""
    require_within("friction", friction, 0, LARGEST_COEFFICIENT, "", "give the coefficient, usual is 0.05")


def sliding_sense(pair: GearPair, lines: ContactLines) -> FloatArray:
    """Return the sign (n,) of the sliding velocity ω_P s − ω_G (L − s): −1, 0 or 1.

    Returns (n,): −1 where the pinion's root touches, 1 where its tip does.
    """
    return np.sign(lines.position - pair.pitch_point)


def lever_arms(pair: GearPair, lines: ContactLines, friction: float) -> FloatArray:
    """Return the torque into the pinion and out of the wheel per normal force of each slice.

    friction: coefficient μ, 0 … 1.
    Returns (2, n): lever arms of pinion and wheel (m).

    T_P = Σ F (± r_bP cos β_b + μ σ s), T_G = Σ F (± r_bG cos β_b + μ σ (L − s)), with + on the drive flanks, − on the
    back flanks, and σ the sense of sliding.

    The friction power is T_P ω_P − T_G ω_G = Σ μ F |ω_P s − ω_G (L − s)|.
    """
    check_coefficient(friction)
    normal = pair.base_radius * cos(pair.base_helix_angle) * (1.0 if lines.flank == DRIVE else -1.0)
    distance = np.stack([lines.position, pair.line_length - lines.position])
    return np.asarray(normal[:, None] + friction * sliding_sense(pair, lines) * distance)
