"""Regression data and tables from what `gear_reference.py` has found."""

from __future__ import annotations

import json
import pickle
from dataclasses import asdict
from pathlib import Path

import numpy as np
from gear_reference_studies import CORNER_GAPS, ROOT, STUDIES, TORQUES, VARIANTS, Record
from matplotlib.figure import Figure

from nvhchain.gear import Blank
from nvhchain.handoff import FloatArray

DATA = ROOT / "tests" / "regression" / "gear"
TABLE = ROOT / "docs" / "measured" / "gear_reference.md"


def described(blank: Blank) -> Record:
    """Class and dimensions of a blank."""
    return {"type": type(blank).__name__, **asdict(blank)}


def regression(study: str, out: Path) -> Record | None:
    """What the tests hold the hybrid contact against: the pair, its blanks and the reference's deflections, m."""
    s = STUDIES[study]()
    found = {b: pickle.loads((out / f"{study}-{b}").read_bytes()) for b in s.blanks if (out / f"{study}-{b}").exists()}
    if not found:
        return None
    blanks = {
        name: {
            "blank": described(s.blanks[name][0]),
            "deflection": {k: np.round(rows["reference"], 12).tolist() for k, rows in record["shifts"].items()},
        }
        for name, record in found.items()
    }
    pair = s.pair
    return {
        "made_by": "benchmarks/gear_reference.py",
        "pinion": {k: v for k, v in asdict(pair.pinion.geometry).items() if k != "micro"},
        "wheel": {k: v for k, v in asdict(pair.wheel.geometry).items() if k != "micro"},
        "centre_distance": pair.centre_distance,
        "width_layers": s.fidelity.width_layers,
        "resolution": asdict(s.resolution),
        "angles_per_mesh": s.angles,
        "torques": list(TORQUES),
        "blanks": blanks,
    }


def harmonics(deflection: FloatArray, count: int = 6) -> FloatArray:
    """Amplitudes (count,) m of a curve over one mesh period taken as periodic."""
    return 2 * np.abs(np.fft.rfft(deflection))[1 : count + 1] / len(deflection)


def comparison(study: str, out: Path) -> list[str]:
    """One table per study: reference, and the hybrid's deviation with and without tip edges."""
    s = STUDIES[study]()
    lines = [
        f"**{study}: {s.pair.pinion.geometry.teeth}/{s.pair.wheel.geometry.teeth} teeth, "
        f"{s.angles} angles of one mesh period**",
        "",
        "| wheel | over tooth | N m | mean / µm | swing / µm | hybrid with | mean / % | swing / % | largest / µm | "
        + " | ".join(f"{i} / dB" for i in range(1, 7))
        + " |",
        "|---|---:|---:|---:|---:|---|" + "---:|" * 9,
    ]
    for blank in s.blanks:
        if not (out / f"{study}-{blank}").exists():
            continue
        for shift, rows in pickle.loads((out / f"{study}-{blank}").read_bytes())["shifts"].items():
            for i, torque in enumerate(TORQUES):
                true = np.array(rows["reference"])[:, i]
                for gap in CORNER_GAPS:
                    own = np.array(rows[f"hybrid {1e6 * gap:g}"])[:, i]
                    change = 20 * np.log10(harmonics(own) / harmonics(true))
                    lines.append(
                        f"| {blank} | {shift} | {torque:g} | {1e6 * true.mean():.3f} | {1e6 * np.ptp(true):.3f} | "
                        f"{'tip edges' if gap else 'path only'} | {100 * (own.mean() / true.mean() - 1):+.2f} | "
                        f"{100 * (np.ptp(own) / np.ptp(true) - 1):+.2f} | {1e6 * np.abs(own - true).max():.3f} | "
                        + " | ".join(f"{c:+.1f}" for c in change)
                        + " |"
                    )
    return [*lines, ""]


def convergence(out: Path) -> list[str]:
    """What finer meshes do to reference and hybrid."""
    found = {v: pickle.loads((out / v).read_bytes()) for v in VARIANTS if (out / v).exists()}
    if "as used" not in found:
        return []
    base = found["as used"]
    lines = [
        "**Mesh of the reference: solid spur pair, one and two pairs of teeth in contact**",
        "",
        "| mesh | s | MB | "
        + " | ".join(f"{n} pair, {t:g} N m / %" for n in ("one", "two") for t in TORQUES)
        + " | hybrid on the same body mesh, largest / % |",
        "|---|---:|---:|" + "---:|" * 7,
    ]
    for name, record in found.items():
        change = 100 * (np.array(record["reference"]) / np.array(base["reference"]) - 1)
        hybrid = 100 * (np.array(record["hybrid"]) / np.array(base["hybrid"]) - 1)
        worst = hybrid.ravel()[np.abs(hybrid).argmax()]
        lines.append(
            f"| {name} | {record['seconds']:.0f} | {record['megabytes']:.0f} | "
            + " | ".join(f"{c:+.2f}" for c in change.ravel())
            + f" | {worst:+.2f} |"
        )
    return [*lines, ""]


SHOWN = (("spur", "3 slots"), ("stage1", "5 slots"))
"""Study and blank drawn; the first tooth over which each is looked at."""


def figure(out: Path) -> None:
    """Deflection over the mesh period: reference, and the hybrid with and without tip edges."""
    shown = [(study, blank) for study, blank in SHOWN if (out / f"{study}-{blank}").exists()]
    fig = Figure(figsize=(4.5 * len(shown), 7.5), layout="constrained")
    axes = fig.subplots(len(TORQUES), len(shown), squeeze=False)
    for column, (study, blank) in enumerate(shown):
        s = STUDIES[study]()
        rows = next(iter(pickle.loads((out / f"{study}-{blank}").read_bytes())["shifts"].values()))
        place = np.arange(s.angles + 1) / s.angles
        for row, torque in enumerate(TORQUES):
            ax = axes[len(TORQUES) - 1 - row, column]
            for key, label, style in (
                ("reference", "reference", "k.-"),
                (f"hybrid {1e6 * CORNER_GAPS[-1]:g}", "hybrid, tip edges", "C0-"),
                (f"hybrid {1e6 * CORNER_GAPS[0]:g}", "hybrid, path alone", "C3--"),
            ):
                curve = 1e6 * np.array(rows[key])[:, row]
                ax.plot(place, np.append(curve, np.nan), style, label=label, linewidth=1)
            ax.set_title(f"{study}, {blank}, {torque:g} N m", fontsize=9)
            ax.set_ylabel("deflection / µm")
        axes[-1, column].set_xlabel("mesh periods")
    if shown:
        axes[0, 0].legend(fontsize=8)
        fig.savefig(TABLE.with_suffix(".png"), dpi=110)


def write(out: Path) -> None:
    """Regression data and tables from what there is."""
    DATA.mkdir(parents=True, exist_ok=True)
    lines = [
        "Measured by `benchmarks/gear_reference.py`. Deflection δ along the flank normal, reference contact (finite "
        "elements with refined flanks alone) against the hybrid contact on the same body mesh, pure involutes. Mesh "
        "harmonics of the mesh period looked at, hybrid over reference. Seconds are processor time.",
        "",
    ]
    for study in STUDIES:
        data = regression(study, out)
        if data is not None:
            (DATA / f"reference_{study}.json").write_text(json.dumps(data, indent=1) + "\n")
            lines += comparison(study, out)
    figure(out)
    TABLE.write_text("\n".join([*lines, *convergence(out)]))
