"""Pair of external involute gears: working geometry, path of contact, backlash, misalignment, and checks.

The pinion drives and turns counter-clockwise about +z (sense +1) or clockwise (−1), the wheel the other way.

Tip edges touch the mating flank beyond the ends of the path of contact. Loaded teeth meet too early and part too late.
Before the path begins, the wheel's tip edge touches the pinion's flank off the line of action. After its end the
pinion's edge touches the wheel's flank.

Involutes of one base circle lie a constant distance apart, the arc between them on that circle.  The gap between an
edge and a flank is therefore the arc from the flank to the involute through the edge.  It is exact for any position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import acos, cos, degrees, lcm, pi, sin, sqrt, tan

import numpy as np
from scipy.optimize import brentq

from nvhchain.dimensions import Angle
from nvhchain.errors import InputError, require, warn_caller
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.geometry import GearGeometry, involute
from nvhchain.gear.drawing.thickness import ROUNDING
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields, checked

LARGEST_ANGLE = 0.02
"""Largest angle (rad); tilts are taken to first order."""


@dataclass(frozen=True)
class Misalignment:
    """Angles of the wheel's axis against the pinion's; the pair keeps its place at the pitch point at mid-width.

    Parameters
    ----------
    in_plane : float
        Angle in the plane of action of the drive flanks (rad); > 0 closes them towards +z.
    normal : float
        Angle across that plane (rad); > 0 takes the wheel away from the pinion towards +z.

    Notes
    -----
    To first order `normal` has no effect on the drive flanks, but it has on the back flanks. A parallel error is part
    of `GearPair.centre_distance`, which is the actual one.
    """

    in_plane: Angle = 0.0
    normal: Angle = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("in_plane", "normal"):
            value = getattr(self, name)
            require(
                abs(value) <= LARGEST_ANGLE,
                f"misalignment {name} = {1e3 * value:g} mrad is beyond ±{1e3 * LARGEST_ANGLE:g} mrad: give it in rad",
            )

    def separation(
        self, path_length: FloatArray, axial: FloatArray, *, drive: bool, sense: int, pressure_angle: float, tilt: float
    ) -> FloatArray:
        """Return the gap (m) that misalignment opens at contact points.

        path_length: distance from the pitch point along the line of action, from pinion to wheel (m).
        axial: axial position (m).
        drive: True for the drive flanks.
        pressure_angle: working pressure angle α_wt (rad).
        tilt: base helix angle β_b (rad), > 0 where the pinion is right-handed.
        Returns gap along the normal (m).

        The wheel's flank turns in the plane of action about the pitch point.
        """
        turn = -self.in_plane
        if not drive:  # the two lines of action enclose 180° − 2 α_wt
            turn = self.in_plane * cos(2 * pressure_angle) + self.normal * sin(2 * pressure_angle)
        slope = sense if drive else -sense
        return np.asarray(turn * (cos(tilt) * axial + slope * sin(tilt) * path_length))


def edge_gap(
    excess: FloatArray, own_base: float, mating_base: float, edge: float, line_length: float, centre_distance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the gap between an edge and the mating flank, and the place and angle at which they will meet.

    excess : (n,) distance on the line of action from the end of the path, which the edge has passed or not reached
        (m).
    own_base, mating_base : base radii of the gear with the edge and of the other (m).
    edge : tip radius of the gear with the edge (m).
    line_length : distance of the base tangent points (m).

    gap : (n,) arc on the mating base circle by which the edge misses the flank (m).
    radius : (n,) radius on the mating gear at which they will meet (m).
    angle : (n,) angle between the flanks there (rad).
    """
    # own centre at the origin, the other on the x axis; angle of the edge from the line of centres
    pressure, end = np.arccos((own_base + mating_base) / centre_distance), sqrt(edge**2 - own_base**2)
    turned = np.arctan2(end, own_base) - pressure + np.asarray(excess, float) / own_base
    x_distance, y_distance = centre_distance - edge * np.cos(turned), edge * np.sin(turned)
    radius = np.hypot(x_distance, y_distance)
    rolled = np.sqrt(np.maximum(radius**2 - mating_base**2, 0.0))
    # mating involute through the edge: its crossing of the line of action, from that gear's tangent point
    crossing = rolled + mating_base * (pressure - np.arctan2(y_distance, x_distance) - np.arctan2(rolled, mating_base))
    # the normal of an involute turns from the line of action by rolled length over base radius
    angle = np.asarray(excess, float) / own_base + (rolled - crossing) / mating_base
    return crossing - (line_length - end - np.asarray(excess, float)), radius, angle


@lru_cache
def extension(gap: float, own_base: float, mating_base: float, edge: float, line: float, distance: float) -> float:
    """Return the length (m) beyond the end of the path at which the unloaded edge misses the flank by `gap` (m).

    The gap is an arc on the mating base circle, as in `edge_gap`.
    """
    if gap == 0:
        return 0.0

    def missing(excess: float) -> float:
        return float(edge_gap(np.array(excess), own_base, mating_base, edge, line, distance)[0]) - gap

    # bounded by the remaining rolled length on the mating gear
    left = line - sqrt(edge**2 - own_base**2)
    return float(brentq(missing, 0.0, 0.9 * left)) if missing(0.9 * left) > 0 else 0.9 * left


DRIVE, BACK = 0, 1

_EXACT = 1e-9
"""Largest negative backlash (m) that counts as none."""

LEAST_SHARE = 0.05
"""Least share of the narrower face that gears in mesh have in common; less is a mistake in their mid-planes."""

_NEARLY = 5e-4
"""Largest relative difference of two base pitches that counts as the rounding of a drawing."""


@dataclass(frozen=True, eq=False)
class GearPair:
    """Pinion and wheel at a centre distance; the wheel's tooth 0 touches at the pitch point at wheel angle 0.

    Parameters
    ----------
    pinion : GearBody
        Driving gear.
    wheel : GearBody
        Driven gear.
    centre_distance : float
        Centre distance (m).
    sense : int
        +1 where the driving pinion turns counter-clockwise about +z, −1 clockwise.
    misalignment : Misalignment
        Angles between the axes.

    Raises
    ------
    InputError
        If the gears cannot run together.
    """

    pinion: GearBody
    wheel: GearBody
    centre_distance: float
    sense: int = 1
    misalignment: Misalignment = Misalignment()

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "wheel", _match_pitch(self.wheel, self.pinion))
        self._check_axes()
        self._check_contact()
        object.__setattr__(self, "wheel", self._remove_jam())

    def _check_axes(self) -> None:
        """Refuse helix angles, centre distances and tips that do not fit each other."""
        p, w, a = self.pinion.geometry, self.wheel.geometry, self.centre_distance
        require(self.sense in (1, -1), f"sense = {self.sense}: +1 (counter-clockwise about z) or -1")
        require(
            abs(p.base_helix_angle + w.base_helix_angle) < 1e-6,
            f"helix angles {degrees(p.helix_angle):.9g} and {degrees(w.helix_angle):.9g}° do not mesh: "
            "give them opposite hands",
        )
        lowest = p.base_radius + w.base_radius
        require(
            a > lowest,
            f"centre_distance = {1e3 * a:.9g} mm is not beyond the base circles' {1e3 * lowest:.9g} mm: increase it",
        )
        middle, shared = 0.5 * (self._face[0] + self._face[1]), self._face[1] - self._face[0]
        least = LEAST_SHARE * min(p.face_width, w.face_width)
        require(
            shared >= least,
            f"faces of pinion and wheel share {1e3 * max(shared, 0.0):.4g} mm along the axis, of {1e3 * least:.4g} mm "
            "at least: move a mid-plane or widen a face",
        )
        require(
            abs(middle) <= _EXACT,
            f"offsets {1e3 * self.pinion.offset:g} and {1e3 * self.wheel.offset:g} mm put the middle of the contact at "
            f"{1e3 * middle:g} mm, not 0: use `offset_bodies`",
        )
        for name, gear, other in (("pinion", p, w), ("wheel", w, p)):
            clearance = a - gear.tip_circle_radius - other.root_radius
            require(
                clearance >= 0,
                f"tip of the {name} reaches {-1e3 * clearance:.3g} mm into the mating root: increase centre_distance "
                "or reduce its addendum",
            )

    def _check_contact(self) -> None:
        """Refuse tips that reach below the mating involute, and contact ratios below 1."""
        p, w = self.geometries
        for name, gear, lowest_contact in (("pinion", p, self.path[0]), ("wheel", w, self.line_length - self.path[1])):
            limit = sqrt(max(gear.form_radius**2 - gear.base_radius**2, 0.0))
            require(
                lowest_contact >= limit,
                f"mating tip meets the {name} {1e3 * (limit - lowest_contact):.3g} mm below the start of its involute "
                f"(rolled length {1e3 * lowest_contact:.5g} of {1e3 * limit:.5g} mm; form circle of radius "
                f"{1e3 * gear.form_radius:.6g} mm{', undercut' if gear.undercut > 0 else ''}): use more teeth, a "
                "larger profile_shift or a smaller mating addendum",
            )
        require(
            self.transverse_contact_ratio > 0 and self.total_contact_ratio >= 1,
            f"contact ratio {self.total_contact_ratio:.3f} is below 1: reduce centre_distance or increase the addenda",
        )

    def _remove_jam(self) -> GearBody:
        """Return the wheel, thinner by a negative backlash that is the rounding of a drawing; refuse a real one."""
        found, wheel = self.backlash, self.wheel.geometry
        require(
            found >= -ROUNDING,
            f"backlash is {1e6 * found:.4g} µm, the flanks jam: increase centre_distance = "
            f"{1e3 * self.centre_distance:.9g} mm or thickness_allowance",
        )
        if found >= -_EXACT:
            return self.wheel
        warn_caller(
            f"backlash is {1e6 * found:.4g} µm: counts as zero, the wheel is drawn thinner by as much (passes as the "
            "rounding of a drawing)",
            kind="backlash",
        )
        self.__dict__.pop("backlash")
        self.__dict__.pop("working_thickness")
        allowance = wheel.thickness_allowance - found / cos(wheel.normal_pressure_angle)
        return replace(self.wheel, geometry=replace(wheel, thickness_allowance=allowance, thickness=None))

    @property
    def geometries(self) -> tuple[GearGeometry, GearGeometry]:
        """Geometries of pinion and wheel."""
        return self.pinion.geometry, self.wheel.geometry

    @cached_property
    def base_radius(self) -> FloatArray:
        """Base radii of pinion and wheel (2,), m."""
        return np.array([g.base_radius for g in self.geometries])

    @cached_property
    def working_pressure_angle(self) -> float:
        """Transverse working pressure angle α_wt (rad): cos α_wt = (r_bP + r_bG)/a."""
        return acos(float(self.base_radius.sum()) / self.centre_distance)

    @property
    def base_helix_angle(self) -> float:
        """Base helix angle β_b (rad), > 0 where the pinion is right-handed."""
        return self.pinion.geometry.base_helix_angle

    @property
    def face_width(self) -> float:
        """Common face width (m), about the middle of the contact."""
        low, high = self._face
        return high - low

    @property
    def _face(self) -> tuple[float, float]:
        """Ends of the common face from the middle of the contact (m)."""
        bodies = (self.pinion, self.wheel)
        return common_face([b.offset for b in bodies], [b.geometry.face_width for b in bodies])

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt (m)."""
        return 2 * pi * float(self.base_radius[1]) / self.wheel.geometry.teeth

    @property
    def line_length(self) -> float:
        """Distance between the base tangent points, a sin α_wt (m)."""
        return self.centre_distance * sin(self.working_pressure_angle)

    @property
    def pitch_point(self) -> float:
        """Position s_C of the pitch point on the line of action (m)."""
        return float(self.base_radius[0]) * tan(self.working_pressure_angle)

    @cached_property
    def path(self) -> tuple[float, float]:
        """Ends (s_A, s_E) of the path of contact (m).

        The wheel's tip crosses the line of action at s_A and the pinion's tip at s_E.
        """
        p, w = self.geometries
        return (
            self.line_length - sqrt(w.tip_form_radius**2 - w.base_radius**2),
            sqrt(p.tip_form_radius**2 - p.base_radius**2),
        )

    def edge(self, gear: int) -> tuple[float, float, float, float, float]:
        """Return the arguments of `edge_gap` for the tip edge of the pinion (0) or the wheel (1)."""
        own, mating = (float(r) for r in self.base_radius[[gear, 1 - gear]])
        return own, mating, self.geometries[gear].tip_form_radius, self.line_length, self.centre_distance

    def extensions(self, corner_gap: float) -> tuple[float, float]:
        """Return the lengths (m) before and after the path where tip edges miss the flank by less than a gap.

        corner_gap: m.
        """
        return extension(corner_gap, *self.edge(1)), extension(corner_gap, *self.edge(0))

    @property
    def transverse_contact_ratio(self) -> float:
        """Transverse contact ratio ε_α."""
        return (self.path[1] - self.path[0]) / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """Overlap ratio ε_β."""
        return self.face_width * abs(tan(self.base_helix_angle)) / self.base_pitch

    @property
    def total_contact_ratio(self) -> float:
        """Total contact ratio ε_γ."""
        return self.transverse_contact_ratio + self.overlap_ratio

    @cached_property
    def working_thickness(self) -> tuple[float, float]:
        """Tooth thickness of pinion and wheel on the working pitch circles, transverse arc (m)."""
        radii = self.base_radius / cos(self.working_pressure_angle)
        p, w = (2 * r * float(g.half_tooth_angle(r)) for g, r in zip(self.geometries, radii, strict=True))
        return p, w

    def tooth_angles(self, angle: float) -> tuple[float, float]:
        """Return where tooth 0 of pinion and wheel stands at a wheel angle, drive flanks in touch.

        Parameters
        ----------
        angle : float
            Wheel angle (rad).

        Returns
        -------
        tuple of 2 float
            Angles of the centre lines at the mid-width of each gear (rad), counter-clockwise from the direction to the
        mating axis.
        """
        half_p, half_w = (
            thickness / 2 * cos(self.working_pressure_angle) / float(base)
            for thickness, base in zip(self.working_thickness, self.base_radius, strict=True)
        )
        ratio = self.wheel.geometry.teeth / self.pinion.geometry.teeth
        turned = self.sense * (ratio * angle - half_p), -self.sense * (angle + half_w)
        return (
            turned[0] + self.pinion.geometry.twist * self.pinion.offset,
            turned[1] + self.wheel.geometry.twist * self.wheel.offset,
        )

    def face_positions(self, axial: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions along the faces of pinion and wheel, from their own mid-planes (m).

        axial: from the middle of the contact (m).
        """
        return axial - self.pinion.offset, axial - self.wheel.offset

    @cached_property
    def backlash(self) -> float:
        """Normal backlash j_bn (m), the travel of δ between the two flanks."""
        working_pitch = self.base_pitch / cos(self.working_pressure_angle)
        transverse = (working_pitch - sum(self.working_thickness)) * cos(self.working_pressure_angle)
        return transverse * cos(self.base_helix_angle)

    @property
    def mesh_period(self) -> float:
        """Wheel angle of one tooth (rad)."""
        return 2 * pi / self.wheel.geometry.teeth

    @property
    def meshes_per_body_period(self) -> int:
        """Mesh periods after which the same sector positions of both blanks meet again."""
        return lcm(self.pinion.sector, self.wheel.sector)

    @property
    def body_period(self) -> float:
        """Wheel angle of `meshes_per_body_period` (rad)."""
        return self.meshes_per_body_period * self.mesh_period

    def normal_force(self, pinion_torque: float) -> float:
        """Return the force along the flank normal (N) that carries `pinion_torque` (N m): T/(r_bP cos β_b)."""
        return pinion_torque / (float(self.base_radius[0]) * cos(self.base_helix_angle))


@checked
def nominal_centre_distance(pinion: GearGeometry, wheel: GearGeometry) -> float:
    """Return the centre distance at which gears without thickness allowance run free of backlash.

    Parameters
    ----------
    pinion, wheel : GearGeometry
        Gears.

    Returns
    -------
    float
        Centre distance (m).

    Raises
    ------
    InputError
        If there is none.

    Notes
    -----
    inv α_wt = inv α_t + 2 tan α_n (x₁ + x₂)/(z₁ + z₂).
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


def _match_pitch(wheel: GearBody, pinion: GearBody) -> GearBody:
    """Return the wheel with the pinion's module and pressure angle where only a rounding parts their base pitches."""
    p, w = pinion.geometry, wheel.geometry
    ratio = p.normal_module * cos(p.normal_pressure_angle) / (w.normal_module * cos(w.normal_pressure_angle))
    text = (
        f"modules {1e3 * p.normal_module:.9g} and {1e3 * w.normal_module:.9g} mm, pressure angles "
        f"{degrees(p.normal_pressure_angle):.9g} and {degrees(w.normal_pressure_angle):.9g}°"
    )
    require(
        abs(ratio - 1) <= _NEARLY,
        f"base pitches differ by {abs(ratio - 1):.3g}, of {_NEARLY:g} at most: {text}: give both gears the same",
    )
    if abs(ratio - 1) < 1e-6:
        return wheel
    warn_caller(
        f"base pitches differ by {abs(ratio - 1):.3g}: {text}; those of the pinion count (passes as the rounding of a "
        "drawing)",
        kind="base pitch",
    )
    tip, angle = w.tip_circle_radius, p.normal_pressure_angle
    same = replace(w, normal_module=p.normal_module, normal_pressure_angle=angle, tip_radius=tip, thickness=None)
    return replace(wheel, geometry=same)


def common_face(planes: Sequence[float], widths: Sequence[float]) -> tuple[float, float]:
    """Return the ends (m) of the face that gears of these mid-planes and face widths share; swapped for none."""
    ends = [(plane - 0.5 * width, plane + 0.5 * width) for plane, width in zip(planes, widths, strict=True)]
    return max(low for low, _ in ends), min(high for _, high in ends)


def offset_bodies(pinion: GearBody, wheel: GearBody, planes: tuple[float, float]) -> tuple[GearBody, GearBody]:
    """Return pinion and wheel with their offsets from the middle of the contact, by mid-planes of their faces (m)."""
    if abs(planes[0] - planes[1]) <= _EXACT:
        return pinion, wheel
    low, high = common_face(planes, [pinion.geometry.face_width, wheel.geometry.face_width])
    middle = 0.5 * (low + high)
    return replace(pinion, offset=planes[0] - middle), replace(wheel, offset=planes[1] - middle)
