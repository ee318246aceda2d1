"""Tooth and body compliance in closed form: thin slices, each bending by itself, for first estimates without elements.

The tooth is a beam of varying depth in plane strain, after C. Weber and K. Banaschek (Schriftenreihe Antriebstechnik
11, 1953).

The body is an elastic ring under the tooth root: P. Sainsot, P. Velex, O. Duverger, "Contribution of gear body to tooth
deflections", J. Mech. Des. 126 (2004) 748–752.

The twist of the body about the held bore is that of a thick-walled tube, r_b² (1/r_i² − 1/r_o²)/(4πGb); in a thin web b
is the web's thickness.  It is common to all teeth and slices.

Otherwise slices and teeth do not interact, and holes and slots have no effect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.handoff import FloatArray
from nvhchain.kinds import checked

_BODY = {  # Sainsot et al., table 1: X = A/θ² + B h² + C h/θ + D/θ + E h + F
    "L": (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
    "M": (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
    "P": (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
    "Q": (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904),
}
_RING = (1.4, 7.0)
"""Range of root radius over bore radius for which the polynomials hold; ratios outside it are clipped."""
_ROOT_ANGLE = (0.01, 0.12)
"""Range of the half angle of the tooth at the root circle (rad) for which the polynomials hold; clipped likewise."""
_PROFILE_POINTS = 400
"""Points along the tooth for its depth and for the integrals; the error is below 1e-4."""


@dataclass(frozen=True, eq=False)
class SliceCompliance:
    """Deflection of a tooth with its body, per transverse load and width.

    radius (n,): radii from form to tip form circle (m), rising.
    compliance (n,): displacement along the line of action per load and width (1/Pa, that is m per N/m).
    twist: displacement of all teeth together per transverse force on any of them (m/N).
    tilt: base helix angle β_b of the gear (rad).
    """

    radius: FloatArray
    compliance: FloatArray
    twist: float
    tilt: float

    def add(self, total: FloatArray, radius: FloatArray, length: FloatArray) -> None:
        """Add the compliance of slices to a matrix.

        total: (n, n) m/N, changed in place.  radius: (n,) m.  length: (n,) m of contact line.
        """
        # the transverse parts of force and displacement carry a factor cos β_b each; the width is ℓ cos β_b
        n = np.arange(len(length))
        total[n, n] += np.interp(radius, self.radius, self.compliance) * np.cos(self.tilt) / length
        total += self.twist * np.cos(self.tilt) ** 2


@checked
def slice_compliance(body: GearBody) -> SliceCompliance:
    """Return the closed-form compliance of the teeth of a gear.

    body: gear; the twist of a thin web is included, openings have no effect.
    Returns compliance over the radius of the flank.
    """
    gear = body.geometry
    radius = np.linspace(gear.form_radius, gear.tip_form_radius, 50)
    angle = gear.pressure_angle_at(radius) - gear.half_tooth_angle(radius)  # load to the normal of the centre line
    arm = gear.base_radius / np.cos(angle)  # radius at which the load meets the centre line
    young, poisson = body.material.young, body.material.poisson
    total = _body(gear, arm, angle, poisson) / young
    y, depth = _depth(gear)
    for i in range(len(radius)):
        position = np.linspace(y[0], arm[i], _PROFILE_POINTS)
        thickness = np.interp(position, y, depth)
        bending = np.trapezoid(12 * (arm[i] - position) ** 2 / thickness**3, position)
        shear = (2.4 / (1 - poisson) + np.tan(angle[i]) ** 2) * np.trapezoid(1 / thickness, position)
        total[i] += np.cos(angle[i]) ** 2 * (1 - poisson**2) / young * (bending + shear)
    return SliceCompliance(radius, total, _twist(body), gear.base_helix_angle)


def _twist(body: GearBody) -> float:
    """Return the twist of rim and web about the bore: m along the line of action per transverse force (m/N)."""
    gear, web = body.geometry, body.blank.web
    inner, outer = gear.bore_radius, gear.root_radius
    square = (inner**-2 - outer**-2) / gear.face_width
    if web is not None:
        square += (web.hub_radius**-2 - web.rim_radius**-2) * (1 / web.thickness - 1 / gear.face_width)
    return gear.base_radius**2 * square * (1 + body.material.poisson) / (2 * np.pi * body.material.young)


def _depth(gear: GearGeometry) -> tuple[FloatArray, FloatArray]:
    """Return positions along the tooth's centre line (m from the axis), root to tip, and the depths there (m)."""
    fillet = gear.fillet(np.linspace(1, 0, _PROFILE_POINTS))
    flank = gear.outline(_PROFILE_POINTS)
    r, psi = np.append(fillet[0], flank[0]), np.append(fillet[1], flank[1])
    order = np.argsort(r * np.cos(psi))
    return (r * np.cos(psi))[order], 2 * (r * np.sin(psi))[order]


def _body(gear: GearGeometry, arm: FloatArray, angle: FloatArray, poisson: float) -> FloatArray:
    """Return the compliance of the ring under the root times Young's modulus, less that of its twist about the bore."""
    h = float(np.clip(gear.root_radius / gear.bore_radius, *_RING))
    theta = float(np.clip(gear.fillet(1.0)[1], *_ROOT_ANGLE))
    L, M, P, Q = (
        a / theta**2 + b * h**2 + c * h / theta + d / theta + e * h + f for a, b, c, d, e, f in _BODY.values()
    )
    lever = (arm - gear.root_radius) / (2 * gear.root_radius * theta)  # relative to the tooth's thickness at the root
    twist = (gear.base_radius / gear.root_radius) ** 2 * (h**2 - 1) * (1 + poisson) / (2 * np.pi)
    return np.cos(angle) ** 2 * (L * lever**2 + M * lever + P * (1 + Q * np.tan(angle) ** 2)) - twist
