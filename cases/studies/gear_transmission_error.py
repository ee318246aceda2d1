"""Quasi-static transmission error of lightweight gears over the body period, with and without friction.

python cases/studies/gear_transmission_error.py OUT

Thesis of S. Shweiki, ch. 4: a solid gear drives a thin-rimmed one (A) or one with three slots in its thicker web (B);
57 teeth each, module 2.6 mm, 23 mm wide, centres 150 mm apart, 10 µm of profile crowning, 50 to 300 Nm, friction 0 and
0.3. The blanks' dimensions are not given there: hub and rim are chosen, web and slots fitted to the masses of 1.72 and
1.68 kg. Leaves the curves and their order spectra in OUT.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

from nvhchain.fidelity import STANDARD
from nvhchain.gear import (
    Blank,
    Engagement,
    Flank,
    GearBody,
    GearGeometry,
    GearPair,
    MicroGeometry,
    Slots,
    ThinRim,
    engaged_reach,
    flank_compliance,
    loaded_transmission_error,
    mass_properties,
)
from nvhchain.lumped import order_lines
from nvhchain.plots import order_spectra, transmission_errors

MODULE, SHIFT = 2.6e-3, 0.3614
GEAR = GearGeometry(
    teeth=57,
    normal_module=MODULE,
    normal_pressure_angle=np.radians(20.0),
    helix_angle=0.0,
    face_width=23e-3,
    bore_radius=20e-3,
    profile_shift=SHIFT,
    dedendum=(148.2e-3 - 141.7e-3) / 2 / MODULE + SHIFT,
    tip_radius=154.5e-3 / 2,
    thickness_allowance=50e-6,
    micro=MicroGeometry(drive=Flank(profile_crowning=10e-6)),
)
HUB, RIM = 30e-3, 63e-3
TORQUES = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
SHOWN = (50.0, 150.0, 300.0)
FRICTION = 0.3
FIDELITY = replace(STANDARD.gear, slices=8, angles_per_mesh=32)


def fitted(blank: object, low: float, high: float, mass: float) -> Blank:
    """`blank(x)` with the mass (kg) asked for, low < x < high."""
    found: Blank = blank(brentq(lambda x: mass_properties(GearBody(GEAR, blank(x))).mass - mass, low, high))  # type: ignore[operator]
    return found


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    blanks = {
        "A, thin rim": fitted(lambda web: ThinRim(web, HUB, RIM), 2e-3, 20e-3, 1.72),
        "B, three slots": fitted(
            lambda width: Slots(3, 34e-3, 60e-3, width, 4e-3, web_thickness=12e-3, hub_radius=HUB, rim_radius=RIM),
            np.radians(20.0),
            np.radians(110.0),
            1.68,
        ),
    }
    pinion = GearBody(GEAR)
    driving = flank_compliance(pinion, FIDELITY, reach=1, friction=True)
    curves: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    spectra, jumps = {}, {}
    for name, blank in blanks.items():
        wheel = GearBody(GEAR, blank)
        pair = GearPair(pinion, wheel, 150e-3)
        print(
            f"{name}: {blank}, {mass_properties(wheel).mass:.3f} kg, contact ratio {pair.transverse_contact_ratio:.4f}"
        )
        driven = flank_compliance(wheel, FIDELITY, reach=engaged_reach(pair), friction=True)
        engagement = Engagement(pair, (driving, driven), FIDELITY)
        for friction in (0.0, FRICTION):
            for torque in TORQUES:
                angle, error = loaded_transmission_error(engagement, torque, friction=friction)
                if torque in SHOWN:
                    curves.setdefault(f"{name}, {torque:g} Nm", {})[f"friction {friction:g}"] = angle, error
                meshes = pair.meshes_per_body_period
                orders, lines = order_lines(error, meshes, GEAR.teeth)
                print(
                    f"  friction {friction:g}, {torque:3g} Nm: mean {1e6 * error.mean():6.2f} µm, "
                    f"peak to peak {1e6 * np.ptp(error):5.2f} µm, mesh order {1e6 * lines[meshes]:.3f} µm"
                    + (f", blank order {1e6 * lines[1]:.3f} µm" if meshes > 1 else "")
                )
                if torque in SHOWN[::2]:
                    spectra[f"{name}, {torque:g} Nm, friction {friction:g}"] = orders, lines
                # the pitch point lies at angle 0, amid single contact: from just before it to just after
                jumps[name, friction, torque] = error[-1] / error[1]

    figure = Figure(figsize=(11.0, 18.0), layout="constrained")
    transmission_errors(curves, axes=figure.subplots(len(curves), 1))
    figure.savefig(out / "transmission_error.png", dpi=120)
    order_spectra(spectra, mesh_order=57.0, spacing=3.0, highest=250.0, decades=4.0)[0].figure.savefig(
        out / "transmission_error_orders.png", dpi=100
    )
    for (name, friction, torque), jump in jumps.items():
        low, high = (1.01, 1.3) if friction else (0.97, 1.03)
        assert low < jump < high, f"{name} at {torque} Nm, friction {friction}: ratio {jump:.3f} at the pitch point"


if __name__ == "__main__":
    main()
