"""Convergence of a loaded mesh with every knob of its discretisation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

Record = dict[str, Any]


def draw(records: dict[str, Record], layers: tuple[int, ...], path: Path) -> None:
    """Largest error of δ against layers, slices, angles and deflections, where all of them were measured."""
    if (
        not {"slotted-grids", "slotted-plane", "slotted-halved", *(f"slotted-layers{n}" for n in layers)}
        <= records.keys()
    ):
        return
    grids = records["slotted-grids"]
    curves = {
        "element layers over the width": _errors({n: records[f"slotted-layers{n}"]["delta"] for n in layers}),
        "slices of a contact line": _errors({int(n): d for n, d in grids["slices"].items()}),
        "angles per mesh period": {int(n): v for n, v in grids["angles"].items()},
        "deflections of the law per doubling": {int(n): v for n, v in grids["deflections"].items()},
    }
    plane = np.abs(np.subtract(records["slotted-plane"]["delta"], records["slotted-halved"]["delta"])).max()
    mean = np.mean(records["slotted-halved"]["delta"])
    figure, axes = plt.subplots(2, 2, figsize=(9, 6.5), layout="constrained", sharey=True)
    for ax, (what, curve) in zip(axes.flat, curves.items(), strict=True):
        ax.loglog(list(curve), [1e9 * v for v in curve.values()], "o-", color="C0")
        ax.axhline(1e9 * 0.01 * mean, color="0.5", ls="--", lw=1)
        ax.set_xticks(list(curve), [str(n) for n in curve], minor=False)
        ax.minorticks_off()
        ax.set_xlabel(what)
        ax.grid(alpha=0.3)
    axes[0, 0].axhline(1e9 * plane, color="C1", lw=1, label="elements in the transverse plane, halved")
    axes[0, 0].plot([], [], color="0.5", ls="--", lw=1, label="1 % of the mean deflection")
    axes[0, 0].legend(fontsize=8)
    for ax in axes[:, 0]:
        ax.set_ylabel("largest error of δ / nm")
    figure.suptitle("Stage 1, slotted wheel, nominal force: errors over the body period against the finest")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _errors(curves: dict[int, list[float]]) -> dict[int, float]:
    """Largest difference, m, to the last curve, of all others."""
    *_, last = curves
    return {n: float(np.abs(np.subtract(c, curves[last])).max()) for n, c in curves.items() if n != last}
