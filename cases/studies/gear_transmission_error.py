"""Quasi-static transmission error of lightweight gears over the body period, with and without friction.

python cases/studies/gear_transmission_error.py OUT [publish]

Thesis of S. Shweiki, ch. 4: a solid gear drives a thin-rimmed one (A) or one with three slots in its thicker web (B),
10 µm of profile crowning, 50 to 300 Nm, friction 0 and 0.3. Leaves the curves and their order spectra in OUT; with
`publish` the measured table and the figures go to docs/measured/gear, too.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from thesis_gears import CENTRE_DISTANCE, CROWNED, FRICTION, TORQUES, blanks_of_chapter_4

from nvhchain.fidelity import STANDARD
from nvhchain.gear import (
    Engagement,
    GearBody,
    GearPair,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
    loaded_transmission_error,
    mass_properties,
)
from nvhchain.lumped import order_lines
from nvhchain.plots import order_spectra, transmission_errors

SPECTRA = (50.0, 300.0)
"""N m, of which order spectra are drawn."""

FIDELITY = replace(STANDARD.gear, width_layers=6, slices=8)
ANGLES_PER_MESH = {"A, thin rim": 96, "B, three slots": 16}
"""A's period is one mesh, B's nineteen."""

CLOSE = "B, three slots"
"""Whose mesh period about the pitch point of a tooth over a slot is drawn as well."""

CLOSE_ANGLES = 64
"""Of that period; none is the pitch point itself."""

BESIDE_PITCH = 1 / 96
"""Mesh periods before and after the pitch point between which the jump is taken."""


def jump_at_pitch(engagement: Engagement, torque: float, friction: float) -> float:
    """Transmission error just before the pitch point, where friction turns, over that just after it."""
    force = engagement.pair.normal_force(torque)
    before, after = (
        loaded_mesh(
            engagement, side * BESIDE_PITCH * engagement.pair.mesh_period, force, guess=1e-9 * force, friction=friction
        ).deflection
        for side in (-1.0, 1.0)
    )
    return before / after


def with_pitch_point_amid(angle: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One period from half of it before angle 0, the pitch point, to half of it after."""
    half, period = len(angle) // 2, len(angle) * angle[1]
    return np.r_[angle[half:] - period, angle[:half]], np.r_[error[half:], error[:half]]


def about_pitch(engagement: Engagement, torque: float, friction: float) -> tuple[np.ndarray, np.ndarray]:
    """Wheel angle (n,) rad over the mesh period about the pitch point, and the transmission error there, m."""
    pair, force = engagement.pair, engagement.pair.normal_force(torque)
    angle = ((np.arange(CLOSE_ANGLES) + 0.5) / CLOSE_ANGLES - 0.5) * pair.mesh_period
    meshes = [loaded_mesh(engagement, a, force, guess=1e-9 * force, friction=friction) for a in angle]
    return angle, np.array([mesh.deflection for mesh in meshes])


def page(rows: list[str]) -> str:
    """What is measured."""
    return "\n".join(
        [
            "Quasi-static transmission error over the body "
            "period of the pairs of the thesis, ch. 4, with 10 µm of profile crowning. Jump: just before the pitch "
            f"point, where friction turns, over just after it, {2 * BESIDE_PITCH:.2g} mesh periods apart; angle 0 is "
            "the pitch point.",
            "",
            "| pair | friction | Nm | mean / µm | peak to peak / µm | mesh order / µm | blank order / µm | jump / % |",
            "|---|---:|---:|---:|---:|---:|---:|---:|",
            *rows,
            "",
            "![transmission error](thesis_transmission_error.png)",
            "",
            "![order spectra](thesis_transmission_error_orders.png)",
            "",
        ]
    )


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    pinion = GearBody(CROWNED)
    reach = engaged_reach(GearPair(pinion, pinion, CENTRE_DISTANCE), FIDELITY.corner_gap)
    driving = flank_compliance(pinion, FIDELITY, reach=reach, friction=True)
    curves: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    close: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    spectra, jumps, rows = {}, {}, []
    for name, blank in blanks_of_chapter_4().items():
        wheel = GearBody(CROWNED, blank)
        pair = GearPair(pinion, wheel, CENTRE_DISTANCE)
        print(
            f"{name}: {blank}, {mass_properties(wheel).mass:.3f} kg, contact ratio {pair.transverse_contact_ratio:.4f}"
        )
        driven = flank_compliance(wheel, FIDELITY, reach=reach, friction=True)
        engagement = Engagement(pair, (driving, driven), replace(FIDELITY, angles_per_mesh=ANGLES_PER_MESH[name]))
        for friction in (0.0, FRICTION):
            for torque in TORQUES:
                angle, error = loaded_transmission_error(engagement, torque, friction=friction)
                panel = curves.setdefault(f"{name}, {torque:g} Nm", {})
                panel[f"friction {friction:g}"] = with_pitch_point_amid(angle, error)
                if name == CLOSE:
                    panel = close.setdefault(f"{name}, one mesh, {torque:g} Nm", {})
                    panel[f"friction {friction:g}"] = about_pitch(engagement, torque, friction)
                meshes = pair.meshes_per_body_period
                orders, lines = order_lines(error, meshes, CROWNED.teeth)
                blank_order = f"{1e6 * lines[1]:.3f}" if meshes > 1 else "0"
                jump = jumps[name, friction, torque] = jump_at_pitch(engagement, torque, friction)
                rows.append(
                    f"| {name} | {friction:g} | {torque:g} | {1e6 * error.mean():.2f} | {1e6 * np.ptp(error):.2f} | "
                    f"{1e6 * lines[meshes]:.3f} | {blank_order} | {100 * (jump - 1):+.1f} |"
                )
                print(rows[-1])
                if torque in SPECTRA:
                    spectra[f"{name}, {torque:g} Nm, friction {friction:g}"] = orders, lines

    figure = Figure(figsize=(24.0, 16.0), layout="constrained")  # a row per torque
    axes = figure.subplots(len(TORQUES), 3)
    transmission_errors(curves, axes=list(axes[:, :2].T.ravel()))
    for ax, (title, panel) in zip(axes[:, 2], close.items(), strict=True):
        for label, (angle, error) in panel.items():
            ax.plot(np.degrees(angle), 1e6 * error, label=label)
        ax.set_title(title, loc="left", fontweight="bold")
        ax.set(xlabel="wheel angle / °", ylabel="transmission error / µm")
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.savefig(out / "transmission_error.png", dpi=120)
    orders_file = out / "transmission_error_orders.png"
    order_spectra(spectra, mesh_order=57.0, spacing=3.0, highest=250.0, decades=4.0)[0].figure.savefig(
        orders_file, dpi=80
    )
    if sys.argv[2:] == ["publish"]:
        sys.path.insert(0, str(Path(__file__).parents[2]))
        from benchmarks.publish import MEASURED, publish

        publish("gear/thesis_transmission_error", page(rows))
        figure.savefig(MEASURED / "gear" / "thesis_transmission_error.png", dpi=55)
        (MEASURED / "gear" / "thesis_transmission_error_orders.png").write_bytes(orders_file.read_bytes())
    for (name, friction, torque), jump in jumps.items():
        low, high = (1.01, 1.3) if friction else (0.97, 1.03)
        assert low < jump < high, f"{name} at {torque} Nm, friction {friction}: ratio {jump:.3f} at the pitch point"


if __name__ == "__main__":
    main()
