"""External involute gears, spur and helical: reference circles, involute flank, trochoid root, tooth depth.

Formulas are those of DIN 3960 / ISO 21771 unless stated otherwise.  They hold for the transverse section at mid-width;
the helix turns the section by z tan β / r about the axis.  Angles of a profile count from the tooth's centre line.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from nvhchain.dimensions import Angle, Length, Unstated
from nvhchain.errors import is_whole, require, require_each
from nvhchain.gear.drawing.micro_geometry import MicroGeometry
from nvhchain.gear.drawing.thickness import MeasuredThickness, check_measured, state_thickness
from nvhchain.gear.drawing.tooth_root import REFERENCE_PROFILES, Protuberance, ToothRoot, state_profile
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_fields

USUAL_RACK_TIP_RADIUS = REFERENCE_PROFILES["A"][1]
"""Tip radius of the basic rack ISO 53 type A (normal modules); the default, or the largest that fits."""


def involute(pressure_angle: ArrayLike) -> FloatArray:
    """Return inv α = tan α − α."""
    angle = np.asarray(pressure_angle, float)
    return np.tan(angle) - angle


@dataclass(frozen=True)
class GearGeometry:
    """Drawing data of one gear.

    Parameters
    ----------
    teeth : int
        Number of teeth, 5 or more.
    normal_module : float
        Normal module (m).
    normal_pressure_angle : float
        Normal pressure angle (rad).
    helix_angle : float
        Helix angle (rad), > 0 right-handed.
    face_width : float
        Face width (m).
    bore_radius : float
        Bore radius (m).
    profile_shift : float
        Profile shift (normal modules).
    addendum : float
        Addendum (normal modules).
    dedendum : float
        Dedendum (normal modules).
    rack_tip_radius : float, optional
        Tip radius of the basic rack (normal modules); by default 0.38, or the largest that fits.
    thickness_allowance : float
        Reduction of the normal tooth thickness at the reference circle (m); gives backlash.
    tip_radius : float, optional
        Tip circle radius (m); by default r + m_n (addendum + profile_shift).
    micro : MicroGeometry
        Material removed from the flanks.
    reference_profile : {'A', 'B', 'C', 'D'}, optional
        Basic rack tooth profile of ISO 53, which gives dedendum and rack_tip_radius.
    tip_chamfer : float
        Radial height of the tip chamfer (m); the flank ends below it, at the tip form circle.
    tip_chamfer_angle : float
        Angle of the chamfer to the radius (rad).
    protuberance : Protuberance, optional
        Protuberance of the tool.
    thickness : MeasuredThickness, optional
        Tooth thickness as measured; gives profile_shift, or thickness_allowance where profile_shift is given.

    Raises
    ------
    InputError
        If the gear cannot be made (pointed tip, neck too thin, bore beyond the root), a value is out of range, or two
        values contradict.

    Notes
    -----
    A gear with fewer teeth than the tool allows is undercut.  The trochoid of the tool's tip ends its involute at
    `form_radius`, above the base circle.  Stages whose mating tip reaches below it are refused.
    """

    teeth: int
    normal_module: Length
    normal_pressure_angle: Angle
    helix_angle: Angle
    face_width: Length
    bore_radius: Length
    profile_shift: float = Unstated(0.0)
    addendum: float = 1.0
    dedendum: float = Unstated(1.25)
    rack_tip_radius: float | None = None
    thickness_allowance: Length = Unstated(0.0)  # noqa: RUF009 (frozen)
    tip_radius: Length | None = None
    micro: MicroGeometry = MicroGeometry()  # noqa: RUF009 (frozen)
    reference_profile: Literal["A", "B", "C", "D"] | None = None
    tip_chamfer: Length = 0.0
    tip_chamfer_angle: Angle = np.pi / 4
    protuberance: Protuberance | None = None
    thickness: MeasuredThickness | None = None

    def __post_init__(self) -> None:
        z = self.teeth
        whole = f"teeth = {z!r}: a whole number from 5 upwards is needed"
        require(is_whole(z), whole)
        require(z >= 0, f"teeth = {z:g}: internal gears (ring gears) are not modelled: leave the stage out")
        object.__setattr__(self, "teeth", int(z))
        check_fields(self)
        limits = (
            ("normal_module", 1e-4, 0.1, "m"),
            ("face_width", 1e-4, 2.0, "m"),
            ("bore_radius", 1e-4, 5.0, "m"),
            ("addendum", 0.1, 2.0, "normal modules"),
            ("dedendum", 0.1, 2.5, "normal modules"),
            ("profile_shift", -2.0, 2.0, "normal modules"),
        )
        pressure, helix = np.degrees(self.normal_pressure_angle), np.degrees(self.helix_angle)
        allowance = self.thickness_allowance
        require_each(
            (z >= 5, whole),
            *(
                (
                    low <= (value := getattr(self, name)) <= high,
                    f"{name} = {value} is outside {low:g}…{high:g} {unit}: give it in {unit}",
                )
                for name, low, high, unit in limits
            ),
            (8 <= pressure <= 40, f"normal_pressure_angle = {pressure:.4g}° is outside 8…40°: usual is 20°"),
            (abs(helix) <= 45, f"helix_angle = {helix:.4g}° is outside −45…45°: usual is 0…30°"),
            (
                abs(allowance) < 0.5 * self.normal_module,
                f"thickness_allowance = {allowance:g} m exceeds half a module: give it in m",
            ),
            (
                0 <= self.tip_chamfer <= 0.5 * self.normal_module,
                f"tip_chamfer = {self.tip_chamfer:g} m is outside 0…{0.5 * self.normal_module:g} m (half a module): "
                "give it in m",
            ),
            (
                0 <= self.tip_chamfer_angle <= np.radians(80),
                f"tip_chamfer_angle = {np.degrees(self.tip_chamfer_angle):.4g}° is outside 0…80°: usual is 45°",
            ),
        )
        for name, value in (*state_profile(self), *state_thickness(self)):
            object.__setattr__(self, name, value)
        self._check_rack()
        self._check_circles()
        check_measured(self)

    def _check_rack(self) -> None:
        """Refuse pointed or badly rounded rack teeth, and teeth that their undercut cuts off."""
        largest, radius = self._largest_rack_tip_radius, self.rack_tip_radius_in_use
        deepest = self.rack_half_width / np.tan(self.normal_pressure_angle)
        require(
            self.dedendum <= deepest,
            f"dedendum = {self.dedendum:g} makes the rack tooth pointed: at most {deepest:.4g} normal modules, "
            "or lower the pressure angle",
        )
        require(
            0 <= radius <= largest + 1e-12,
            f"rack_tip_radius = {radius:g} does not fit the rack tooth: at most {largest:.4g} normal modules",
        )
        if self.undercut > 0 or self.protuberance is not None:
            self._root.check_neck()

    def _check_circles(self) -> None:
        """Refuse pointed teeth, a bore beyond the root, and micro-geometry that does not fit."""
        tip, root, bore = self.tip_circle_radius, self.root_radius, self.bore_radius
        require(
            self.form_radius < tip < np.inf,
            f"tip_radius = {tip:g} m does not lie above the usable flank ({self.form_radius:g} m): give it in m",
        )
        require(
            self.form_radius < self.tip_form_radius,
            f"tip_chamfer = {1e3 * self.tip_chamfer:g} mm leaves no flank between the form circle (radius "
            f"{1e3 * self.form_radius:.6g} mm) and the tip circle ({1e3 * tip:.6g} mm): lower it",
        )
        radius = np.linspace(tip, self.form_radius, 1000)
        half = self.half_tooth_angle(radius)
        require(
            bool(half[0] > 0),
            f"teeth are pointed at {np.interp(0.0, half, radius):g} m, below tip_radius = {tip:g} m: lower tip_radius, "
            "addendum or profile_shift",
        )
        lean = np.degrees(float(self.pressure_angle_at(tip)))
        require(
            self.tip_chamfer == 0 or np.degrees(self.tip_chamfer_angle) > lean,
            f"tip_chamfer_angle = {np.degrees(self.tip_chamfer_angle):.4g}° to the radius is below the {lean:.4g}° at "
            "which the flank leans: it would add material; raise it",
        )
        land = 2e3 * tip * float(self.half_outline_angle(tip))
        require(
            land > 0,
            f"tip_chamfer = {1e3 * self.tip_chamfer:g} mm at {np.degrees(self.tip_chamfer_angle):.4g}° leaves "
            f"{land:.3g} mm of tip land, of more than 0: lower either",
        )
        require(
            bore < root - self.normal_module,
            f"bore_radius = {bore:g} m leaves less than one module below the root circle ({root:g} m): "
            f"at most {root - self.normal_module:g} m",
        )
        low, high = self.usable_flank
        self.micro.check(high - low, 0.05 * self.normal_module)

    @cached_property
    def transverse_module(self) -> float:
        """Transverse module m_t = m_n / cos β (m)."""
        return float(self.normal_module / np.cos(self.helix_angle))

    @cached_property
    def pitch_radius(self) -> float:
        """Reference radius r = z m_t / 2 (m)."""
        return 0.5 * self.teeth * self.transverse_module

    @cached_property
    def transverse_pressure_angle(self) -> float:
        """Transverse pressure angle α_t (rad): tan α_t = tan α_n / cos β."""
        return float(np.arctan(np.tan(self.normal_pressure_angle) / np.cos(self.helix_angle)))

    @cached_property
    def base_radius(self) -> float:
        """Base radius r_b = r cos α_t (m)."""
        return float(self.pitch_radius * np.cos(self.transverse_pressure_angle))

    @cached_property
    def base_helix_angle(self) -> float:
        """Base helix angle β_b (rad), > 0 right-handed: tan β_b = tan β cos α_t."""
        return float(np.arctan(np.tan(self.helix_angle) * np.cos(self.transverse_pressure_angle)))

    @property
    def relative_width(self) -> float:
        """Face width over the normal module."""
        return self.face_width / self.normal_module

    @property
    def tip_circle_radius(self) -> float:
        """Tip radius in use (m)."""
        if self.tip_radius is not None:
            return self.tip_radius
        return self.pitch_radius + self.normal_module * (self.addendum + self.profile_shift)

    @property
    def tip_form_radius(self) -> float:
        """Tip form radius r_Fa = r_a − tip_chamfer (m), where the flank ends."""
        return self.tip_circle_radius - self.tip_chamfer

    @property
    def normal_thickness(self) -> float:
        """Normal tooth thickness at the reference circle (m): s_n = m_n (π/2 + 2 x tan α_n) − allowance."""
        thickness = self.normal_module * (np.pi / 2 + 2 * self.profile_shift * np.tan(self.normal_pressure_angle))
        return float(thickness - self.thickness_allowance)

    @property
    def undercut(self) -> float:
        """Depth of the tool's straight flank below the least that an involute takes (normal modules).

        Positive: undercut.  Zero is the limit h_fP − ρ_fP (1 − sin α_n) − x = z sin² α_t/(2 cos β).
        """
        radius = self.rack_tip_radius_in_use
        depth = self.dedendum - radius * (1 - np.sin(self.normal_pressure_angle)) - self.profile_shift
        admissible = self.pitch_radius / self.normal_module * np.sin(self.transverse_pressure_angle) ** 2
        return float(depth - admissible)

    @property
    def root_radius(self) -> float:
        """Root radius r − m_n (dedendum − profile_shift) (m)."""
        return self.pitch_radius - self.normal_module * (self.dedendum - self.profile_shift)

    @property
    def rack_tip_radius_in_use(self) -> float:
        """Rack tip radius in use (normal modules)."""
        if self.rack_tip_radius is not None:
            return self.rack_tip_radius
        return min(USUAL_RACK_TIP_RADIUS, self._largest_rack_tip_radius)

    @property
    def _largest_rack_tip_radius(self) -> float:
        """Rack tip radius of a full fillet (normal modules).

        The tip arc takes the whole half width of the rack tooth at its tip.
        """
        angle = self.normal_pressure_angle
        half_width = self.rack_half_width - self.dedendum * np.tan(angle)
        return float(half_width * np.cos(angle) / (1 - np.sin(angle)))

    @property
    def rack_half_width(self) -> float:
        """Half width of the rack tooth, which cuts the gear's tooth space, on its datum line (normal modules)."""
        return np.pi / 4 + 0.5 * self.thickness_allowance / self.normal_module

    @property
    def pitch_angle(self) -> float:
        """Angle from tooth to tooth, 2π/z (rad)."""
        return 2 * np.pi / self.teeth

    @property
    def twist(self) -> float:
        """Rotation of the transverse section per length, tan β / r (rad/m), > 0 right-handed."""
        return float(np.tan(self.helix_angle) / self.pitch_radius)

    def pressure_angle_at(self, radius: ArrayLike) -> FloatArray:
        """Return the transverse pressure angle α_r = arccos(r_b / r) (rad) of the flank at `radius` (m, ≥ r_b)."""
        return np.arccos(np.minimum(self.base_radius / np.asarray(radius, float), 1.0))

    def roll_angle_at(self, radius: ArrayLike) -> FloatArray:
        """Return the roll angle tan α_r (rad) of the flank at `radius` (m)."""
        return np.tan(self.pressure_angle_at(radius))

    def half_tooth_angle(self, radius: ArrayLike) -> FloatArray:
        """Return the angle ψ (rad) from the tooth's centre line to its involute at `radius` (m).

        ψ = s_t/(2 r) + inv α_t − inv α_r with s_t = normal_thickness / cos β.
        """
        half = 0.5 * self.normal_thickness / np.cos(self.helix_angle) / self.pitch_radius
        return half + involute(self.transverse_pressure_angle) - involute(self.pressure_angle_at(radius))

    def half_outline_angle(self, radius: ArrayLike) -> FloatArray:
        """Return the angle (rad) from the tooth's centre line to its outline at `radius` (m), chamfer included."""
        radius = np.asarray(radius, float)
        cut = np.maximum(radius - self.tip_form_radius, 0.0) * np.tan(self.tip_chamfer_angle) / radius
        return self.half_tooth_angle(np.minimum(radius, self.tip_form_radius)) - cut

    def outline(self, points: int) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and half angle (rad) of `points` from form circle to tip, and the end of a chamfer."""
        radius = np.linspace(self.form_radius, self.tip_form_radius, points)
        radius = np.append(radius, [self.tip_circle_radius] if self.tip_chamfer else [])
        return radius, self.half_outline_angle(radius)

    def depth_to_centre_line(self, radius: ArrayLike) -> FloatArray:
        """Return the depth h (m) along the flank's inward normal from `radius` (m) to the tooth's centre-line surface.

        Along the normal the point follows the tangent of the base circle and moves by sin β_b along the axis.

        The depth h is the distance at which its angle meets that of the (helical) centre-line surface.
        """
        alpha, psi = self.pressure_angle_at(radius), self.half_tooth_angle(radius)
        base, tilt = self.base_radius, self.base_helix_angle
        roll = np.tan(alpha)
        depth = base * (roll - np.tan(alpha - psi)) * np.cos(tilt)
        for _ in range(4):  # Newton; the start is exact without helix and within tan²β_b of the solution
            reached_roll = roll - depth * np.cos(tilt) / base
            angle = psi - alpha + np.arctan(reached_roll) - depth * np.sin(tilt) * np.tan(tilt) / base
            slope = -np.cos(tilt) / base / (1 + reached_roll**2) - np.sin(tilt) * np.tan(tilt) / base
            depth = depth - angle / slope
        return depth

    @cached_property
    def form_radius(self) -> float:
        """Radius at which the involute ends and the root fillet begins (m)."""
        return float(self.fillet(0.0)[0])

    @cached_property
    def usable_flank(self) -> tuple[float, float]:
        """Rolled lengths √(r² − r_b²) of form and tip form circle (m)."""
        low, high = (self.base_radius * float(self.roll_angle_at(r)) for r in (self.form_radius, self.tip_form_radius))
        return low, high

    def removed(self, radius: FloatArray, axial: FloatArray, *, drive: bool) -> FloatArray:
        """Return the material removed along the normal (m) from the drive or coast flank at `radius`, `axial` (m)."""
        flank = self.micro.drive if drive else self.micro.coast
        rolled = self.base_radius * self.roll_angle_at(radius)
        return flank.removed(rolled, self.usable_flank, axial, self.face_width)

    def fillet(self, fraction: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return radius (m) and angle from the tooth's centre line (rad) of the root fillet cut by the rack's tip.

        fraction: 0 at the end of the involute, 1 on the root circle.
        """
        return self._root.fillet(fraction)

    @cached_property
    def _root(self) -> ToothRoot:
        return ToothRoot(self)
