"""Tooth and body compliance in closed form: thin slices, each bending by itself, for a first look without elements.

Tooth: beam of varying depth after C. Weber and K. Banaschek (Schriftenreihe Antriebstechnik 11, 1953), plane strain.
Body: elastic ring under the tooth root, P. Sainsot, P. Velex, O. Duverger, "Contribution of gear body to tooth
deflections", J. Mech. Des. 126 (2004) 748–752. Its twist about the held bore, r_b² (1/r_i² − 1/r_o²)/(4πGb) of a
thick-walled tube, in thin webs over their thickness, is common to all teeth and slices. Of the rest slices and teeth do
not know from each other, and what holes and slots do is missing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.handoff import FloatArray
from nvhchain.kinds import check_arguments

_BODY = {  # Table 1: X = A/θ² + B h² + C h/θ + D/θ + E h + F
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}
_RING = (1.4, 7.0)
"""Root over bore radius for which the polynomials hold; beyond it the nearer end is taken."""
_ROOT_ANGLE = (0.01, 0.12)
"""Half angle of the tooth at the root circle, rad, likewise."""
_PROFILE_POINTS = 400
"""Of tooth depth and of the integrals along the tooth; the error is below 1e-4."""


@dataclass(frozen=True, eq=False)
class SliceCompliance:
    """Deflection of a tooth with its body per transverse load and width.

    radius: (n,) m, rising, from form to tip circle.  compliance: (n,) 1/Pa, displacement along the line of action per
    N/m of width.  twist: m/N, the same of all teeth together per transverse force on any.  tilt: β_b of the gear, rad.
    """

    radius: FloatArray
    compliance: FloatArray
    twist: float
    tilt: float

    def add(self, total: FloatArray, radius: FloatArray, length: FloatArray) -> None:
        """Add to `total` (n, n) m/N what slices at `radius` with `length` of contact line, m, give way."""
        # force and displacement turn by β_b from the normal to the transverse plane, the width is ℓ cos β_b
        n = np.arange(len(length))
        total[n, n] += np.interp(radius, self.radius, self.compliance) * np.cos(self.tilt) / length
        total += self.twist * np.cos(self.tilt) ** 2


def slice_compliance(body: GearBody) -> SliceCompliance:
    """Closed-form compliance of the teeth of `body`; of its blank the twist of a thin web enters, openings do not."""
    check_arguments(slice_compliance, locals())
    gear = body.geometry
    radius = np.linspace(gear.form_radius, gear.tip_circle_radius, 50)
    angle = gear.pressure_angle_at(radius) - gear.half_tooth_angle(radius)  # of the load against the tooth's middle
    arm = gear.base_radius / np.cos(angle)  # where it meets the middle
    young, poisson = body.material.young, body.material.poisson
    total = _body(gear, arm, angle, poisson) / young
    y, depth = _depth(gear)
    for i in range(len(radius)):
        at = np.linspace(y[0], arm[i], _PROFILE_POINTS)
        thickness = np.interp(at, y, depth)
        bending = np.trapezoid(12 * (arm[i] - at) ** 2 / thickness**3, at)
        shear = (2.4 / (1 - poisson) + np.tan(angle[i]) ** 2) * np.trapezoid(1 / thickness, at)
        total[i] += np.cos(angle[i]) ** 2 * (1 - poisson**2) / young * (bending + shear)
    return SliceCompliance(radius, total, _twist(body), gear.base_helix_angle)


def _twist(body: GearBody) -> float:
    """Displacement along the line of action, m, per transverse force, N, by which rim and web twist about the bore."""
    gear, web = body.geometry, body.blank.web
    inner, outer = gear.bore_radius, gear.root_radius
    square = (inner**-2 - outer**-2) / gear.face_width
    if web is not None:
        square += (web.hub_radius**-2 - web.rim_radius**-2) * (1 / web.thickness - 1 / gear.face_width)
    return gear.base_radius**2 * square * (1 + body.material.poisson) / (2 * np.pi * body.material.young)


def _depth(gear: GearGeometry) -> tuple[FloatArray, FloatArray]:
    """Depth of the tooth (m) along its middle (m from the axis), rising, root to tip."""
    fillet = gear.fillet(np.linspace(1, 0, _PROFILE_POINTS))
    flank = np.linspace(gear.form_radius, gear.tip_circle_radius, _PROFILE_POINTS)
    r, psi = np.append(fillet[0], flank), np.append(fillet[1], gear.half_tooth_angle(flank))
    order = np.argsort(r * np.cos(psi))
    return (r * np.cos(psi))[order], 2 * (r * np.sin(psi))[order]


def _body(gear: GearGeometry, arm: FloatArray, angle: FloatArray, poisson: float) -> FloatArray:
    """Young's modulus times compliance of the ring under the root, less that of its twist about the bore."""
    h = float(np.clip(gear.root_radius / gear.bore_radius, *_RING))
    theta = float(np.clip(gear.fillet(1.0)[1], *_ROOT_ANGLE))
    L, M, P, Q = (
        a / theta**2 + b * h**2 + c * h / theta + d / theta + e * h + f for a, b, c, d, e, f in _BODY.values()
    )
    lever = (arm - gear.root_radius) / (2 * gear.root_radius * theta)  # over the tooth's thickness at the root
    twist = (gear.base_radius / gear.root_radius) ** 2 * (h**2 - 1) * (1 + poisson) / (2 * np.pi)
    return np.cos(angle) ** 2 * (L * lever**2 + M * lever + P * (1 + Q * np.tan(angle) ** 2)) - twist
