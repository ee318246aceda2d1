"""How contact loss bends a resonance: periodic motions by harmonic balance along the exact backbone, at three dampings.

python cases/studies/contact_loss_backbone.py OUT

Leaves a figure in OUT. The stretch between two folds is unstable: a sweep jumps over it, up at one end, down at the
other.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from nvhchain.lumped import BASE_RADIUS, backbone_frequency, pair_from_error, periodic_response
from nvhchain.lumped import static_transmission_error as error_curve
from nvhchain.plots import backbone_curves


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    error, cycles = error_curve(average=20e-6, mesh=1e-6, teeth=57, blank_order=57)
    pair = pair_from_error(
        error, force=350.0 / BASE_RADIUS, mass=0.65, mesh_cycles=cycles, damping_ratio=0.02, half_backlash=50e-6
    )
    curves = {}
    for damping_ratio in (0.02, 0.015, 0.0125):
        damped = replace(pair, damping_ratio=damping_ratio)
        low, high = 0.6 * pair.natural_frequency, 1.4 * pair.natural_frequency
        curves[f"damping {100 * damping_ratio:g} %"] = damped, periodic_response(damped, low, high)
    backbone_curves(curves)[0].figure.savefig(out / "backbone.png")
    worst = 0.0
    for name, (damped, response) in curves.items():
        peak = int(np.argmax(response.rms))
        ratio = (response.highest[peak] - damped.half_backlash) * damped.mean_stiffness / damped.force - 1.0
        off = response.mesh_frequency[peak] / damped.natural_frequency / float(backbone_frequency(ratio)) - 1.0
        worst = max(worst, abs(off))
        folds = ", ".join(f"{f:.0f}" for f in response.folds) or "none"
        print(f"{name}: peak {ratio:.2f} static deflections, {100 * off:+.2f} % off the backbone; folds at {folds} Hz")
    assert worst < 0.01, f"a peak lies {100 * worst:.2f} % off the backbone"


if __name__ == "__main__":
    main()
