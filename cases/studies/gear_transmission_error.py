"""Quasi-static transmission error of lightweight gears over the body period, with and without friction.

python cases/studies/gear_transmission_error.py OUT [publish]

Thesis of S. Shweiki, ch. 4: a solid gear drives one with a thin web (A) or with three slots (B); the driving gear has
10 µm of profile crowning; 50 to 300 Nm.  Friction of 0.3 acts in the balance of torque alone, as in the thesis, or
bends the teeth too.  Leaves the curves and their order spectra in OUT; with `publish` the measured table and the
figures go to docs/measured/gear, too.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from thesis_gears import CENTRE_DISTANCE, CROWNED, FRICTION, PAIRS_OF_CHAPTER_4, SPUR, TORQUES

from nvhchain.fidelity import STANDARD
from nvhchain.gear import (
    Engagement,
    GearBody,
    GearPair,
    engaged_reach,
    flank_compliance,
    loaded_mesh,
    loaded_transmission_error,
)
from nvhchain.lumped import order_lines
from nvhchain.plots import order_spectra, transmission_errors

SPECTRA = (50.0, 300.0)
"""Torques (N m) whose order spectra are drawn."""

RUBBING = {"none": (0.0, True), "torque": (FRICTION, False), "bending": (FRICTION, True)}
"""Coefficient of friction, and whether it bends the teeth."""

FIDELITY = replace(STANDARD.gear, width_layers=6, slices=8)
ANGLES_PER_MESH = {"A, thin web": 96, "B, three slots": 16}
"""A's period is one mesh, B's nineteen."""

CLOSE = "B, three slots"
"""Whose mesh period about the pitch point of a tooth over a slot is drawn as well."""

CLOSE_ANGLES = 64
"""Of that period; none is the pitch point itself."""

BESIDE_PITCH = 1 / 96
"""Mesh periods before and after the pitch point between which the jump is taken."""


def step_at_pitch(engagement: Engagement, torque: float, kind: str) -> float:
    """Return the transmission error (m) just before the pitch point, where friction turns, less that just after it."""
    friction, bends = RUBBING[kind]
    force, angle = engagement.pair.normal_force(torque), BESIDE_PITCH * engagement.pair.mesh_period
    before, after = (
        loaded_mesh(engagement, side * angle, force, guess=1e-9 * force, friction=friction, friction_bending=bends)
        for side in (-1.0, 1.0)
    )
    return before.deflection - after.deflection


def with_pitch_point_amid(angle: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One period from half of it before angle 0, the pitch point, to half of it after."""
    half, period = len(angle) // 2, len(angle) * angle[1]
    return np.r_[angle[half:] - period, angle[:half]], np.r_[error[half:], error[:half]]


def about_pitch(engagement: Engagement, torque: float, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return wheel angle (n,) in rad over the mesh period about the pitch point, and transmission error there (m)."""
    pair, (friction, bends) = engagement.pair, RUBBING[kind]
    force, guess, found = pair.normal_force(torque), 1e-9 * pair.normal_force(torque), []
    angle = ((np.arange(CLOSE_ANGLES) + 0.5) / CLOSE_ANGLES - 0.5) * pair.mesh_period
    for a in angle:
        mesh = loaded_mesh(engagement, a, force, guess=guess, friction=friction, friction_bending=bends)
        guess = mesh.deflection
        found.append(guess)
    return angle, np.array(found)


def page(rows: list[str]) -> str:
    """Return the measured page."""
    return "\n".join(
        [
            "Quasi-static transmission error over the body period of the pairs of the thesis, ch. 4: gears of ch. 3, "
            f"10 µm of profile crowning on gear 1 alone. Friction {FRICTION:g} acts in the balance of torque alone "
            "(torque), as in the thesis, or bends the teeth as well (bending). Step: just before the pitch point, "
            f"where friction turns, less just after it, {2 * BESIDE_PITCH:.2g} mesh periods apart; angle 0 is the "
            "pitch point.",
            "",
            "| pair | friction | Nm | mean / µm | peak to peak / µm | mesh order / µm | blank order / µm | step / µm |",
            "|---|---|---:|---:|---:|---:|---:|---:|",
            *rows,
            "",
            "Thesis, without friction: mesh order 0.91 µm at 50 Nm and 1.50 µm at 300 Nm; with friction at 300 Nm "
            "(figure 4.13 b): a step of 5.2 µm in a curve of 6.2 µm. The trend with torque and the step are those of "
            "pair A with friction in the torque alone. Where friction bends the teeth as well, that step vanishes.",
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
    reach = engaged_reach(GearPair(pinion, GearBody(SPUR), CENTRE_DISTANCE), FIDELITY.corner_gap)
    driving = flank_compliance(pinion, FIDELITY, reach=reach, friction=True)
    curves: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    close: dict[str, dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    spectra, rows = {}, []
    steps: dict[tuple[str, str, float], float] = {}
    for name, blank in PAIRS_OF_CHAPTER_4.items():
        wheel = GearBody(SPUR, blank)
        pair = GearPair(pinion, wheel, CENTRE_DISTANCE)
        driven = flank_compliance(wheel, FIDELITY, reach=reach, friction=True)
        engagement = Engagement(pair, (driving, driven), replace(FIDELITY, angles_per_mesh=ANGLES_PER_MESH[name]))
        for kind, (friction, bends) in RUBBING.items():
            for torque in TORQUES:
                angle, error = loaded_transmission_error(engagement, torque, friction=friction, friction_bending=bends)
                panel = curves.setdefault(f"{name}, {torque:g} Nm", {})
                panel[f"friction: {kind}"] = with_pitch_point_amid(angle, error)
                if name == CLOSE:
                    panel = close.setdefault(f"{name}, one mesh, {torque:g} Nm", {})
                    panel[f"friction: {kind}"] = about_pitch(engagement, torque, kind)
                meshes = pair.meshes_per_body_period
                orders, lines = order_lines(error, meshes, SPUR.teeth)
                blank_order = f"{1e6 * lines[1]:.3f}" if meshes > 1 else "0"
                step = steps[name, kind, torque] = step_at_pitch(engagement, torque, kind)
                rows.append(
                    f"| {name} | {kind} | {torque:g} | {1e6 * error.mean():.2f} | {1e6 * np.ptp(error):.2f} | "
                    f"{1e6 * lines[meshes]:.3f} | {blank_order} | {1e6 * step:+.2f} |"
                )
                print(rows[-1], flush=True)
                if torque in SPECTRA and kind != "bending":
                    spectra[f"{name}, {torque:g} Nm, friction: {kind}"] = orders, lines

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
    for (name, kind, torque), step in steps.items():
        low, high = (-0.3, 0.3) if kind == "none" else (-0.1, 13.0)
        assert low < 1e6 * step < high, f"{name} at {torque} Nm, friction: {kind}: step of {1e6 * step:.2f} µm"


if __name__ == "__main__":
    main()
