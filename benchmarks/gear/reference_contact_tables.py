"""Regression data and tables from what `reference_contact.py` has found."""

from __future__ import annotations

import json
import pickle
from dataclasses import asdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.gear.reference_contact_studies import (
    CONVERGENCE,
    CORNER_GAPS,
    RELIEVED,
    RELIEVED_LAYERS,
    RELIEVED_RESOLUTION,
    ROOT,
    STUDIES,
    THICK_TEETH,
    TORQUES,
    Record,
)
from benchmarks.publish import MEASURED, publish
from nvhchain.gear import Blank, GearGeometry
from nvhchain.gear.contact.contact_lines import contact_lines, separation
from nvhchain.handoff import FloatArray

DATA = ROOT / "tests" / "regression" / "gear"


def described(blank: Blank) -> Record:
    """Class and dimensions of a blank."""
    return {"type": type(blank).__name__, **asdict(blank)}


def macro(geometry: GearGeometry) -> Record:
    """Its dimensions without what is taken off the flanks."""
    return {k: v for k, v in asdict(geometry).items() if k != "micro"}


def kept(study: str) -> Record:
    """What is stored of a study, if its pair and mesh are still the same; otherwise nothing."""
    file = data_file(study)
    found: Record = json.loads(file.read_text()) if file.exists() else {}
    now = json.loads(json.dumps(drawn(study)))
    return found if all(found.get(key) == value for key, value in now.items()) else {}


def data_file(study: str) -> Path:
    """Of the regression data."""
    return DATA / f"reference_{study.replace(' ', '_')}.json"


def drawn(study: str) -> Record:
    """Pair and mesh of a study."""
    s = STUDIES[study]()
    return {
        "made_by": "benchmarks/gear/reference_contact.py",
        **({"note": THICK_TEETH} if study.startswith("spur") else {}),
        "pinion": macro(s.pair.pinion.geometry),
        "wheel": macro(s.pair.wheel.geometry),
        "centre_distance": s.pair.centre_distance,
        "width_layers": s.fidelity.width_layers,
        "resolution": asdict(s.resolution),
        "angles_per_mesh": s.angles,
        "torques": list(TORQUES),
    }


def regression(study: str, out: Path) -> Record:
    """What the tests hold the hybrid contact against: the pair, its conditions and the reference's deflections, m.

    Of what is in `out`, else of what is stored.
    """
    s, before = STUDIES[study](), kept(study)
    kinds: Record = {"blanks": {}, "misaligned": {}}
    for name, condition in s.conditions.items():
        kind, file = "blanks" if condition.aligned else "misaligned", out / f"{study}-{name}"
        if not file.exists():
            if name in before.get(kind, {}):
                kinds[kind][name] = before[kind][name]
            continue
        shifts = pickle.loads(file.read_bytes())["shifts"]
        record: Record = {
            "blank": described(s.blanks[condition.blank]),
            "deflection": {shift: np.round(rows["reference"], 12).tolist() for shift, rows in shifts.items()},
        }
        if not condition.aligned:
            changes = {"in_plane": condition.misalignment.in_plane, "lead_slope": condition.lead_slope}
            record |= changes
        if condition.torques != TORQUES:
            record["torques"] = list(condition.torques)
        kinds[kind][name] = record
    return {**drawn(study), **kinds, "finer": finer_meshes(study, out)}


def finer_meshes(study: str, out: Path) -> Record:
    """[mesh][mesh periods] deflections (torques,), m, of finer meshes and of the one used."""
    before, found = kept(study).get("finer", {}), {}
    which = CONVERGENCE.get(study)
    for variant in which.variants if which else ():
        for name, place in which.places.items() if which else ():
            file, key = out / f"{study}-{variant}, {name}", f"{place:.9g}"
            if file.exists():
                found.setdefault(variant, {})[key] = pickle.loads(file.read_bytes())["reference"]
            elif key in before.get(variant, {}):
                found.setdefault(variant, {})[key] = before[variant][key]
    return found


def harmonics(deflection: FloatArray, count: int = 6) -> FloatArray:
    """Amplitudes (count,) m of a curve over one mesh period taken as periodic."""
    return 2 * np.abs(np.fft.rfft(deflection))[1 : count + 1] / len(deflection)


def first_touch(study: str, condition: str, shift: str) -> FloatArray:
    """(angles,) m: approach at which unloaded flanks touch, 0 without misalignment and slope."""
    s = STUDIES[study]()
    pair = s.pair_under(s.conditions[condition])
    angles = [s.angle(i) + int(shift) * pair.mesh_period for i in range(s.angles)]
    lines = [contact_lines(pair, a, slices=48, corner_gap=CORNER_GAPS[-1]) for a in angles]
    return np.array([separation(pair, found).min() for found in lines])


def curves(
    study: str, condition: str, data: Record, out: Path
) -> dict[str, tuple[FloatArray, dict[float, FloatArray]]]:
    """Deflections (angles, torques), m, by shift: of the reference, and of the hybrid by its `corner_gap`."""
    file, known = out / f"{study}-hybrid, {condition}", {**data["blanks"], **data["misaligned"]}
    if condition not in known or not file.exists():
        return {}
    hybrid = pickle.loads(file.read_bytes())
    return {
        shift: (np.array(reference), {g: np.array(hybrid[shift][f"{1e6 * g:g}"]) for g in CORNER_GAPS})
        for shift, reference in known[condition]["deflection"].items()
    }


def comparison(study: str, data: Record, out: Path) -> list[str]:
    """One table per study: reference, and the hybrid's deviation with and without tip edges."""
    s = STUDIES[study]()
    lines = [
        f"**{study}: {s.pair.pinion.geometry.teeth}/{s.pair.wheel.geometry.teeth} teeth, "
        f"{1e3 * s.pair.centre_distance:.3f} mm apart, {s.angles} angles of one mesh period, "
        f"{s.fidelity.width_layers} layers, pressure looked for within {1e3 * s.resolution.reach:g} mm**",
        "",
        "| wheel | over tooth | N m | mean / µm | swing / µm | hybrid with | mean / % | swing / % | largest / µm | "
        + " | ".join(f"{i} / dB" for i in range(1, 7))
        + " |",
        "|---|---:|---:|---:|---:|---|" + "---:|" * 9,
    ]
    for name, condition in s.conditions.items():
        for shift, (reference, hybrid) in curves(study, name, data, out).items():
            touch = first_touch(study, name, shift).mean()
            for i, torque in enumerate(condition.torques):
                true = reference[:, i]
                for gap in CORNER_GAPS:
                    own = hybrid[gap][:, i]
                    levels = [f"{c:+.1f}" for c in 20 * np.log10(harmonics(own) / harmonics(true))]
                    mean = 100 * (own.mean() - true.mean()) / (true.mean() - touch)
                    lines.append(
                        f"| {name} | {shift} | {torque:g} | {1e6 * true.mean():.3f} | {1e6 * np.ptp(true):.3f} | "
                        f"{'tip edges' if gap else 'path only'} | {mean:+.2f} | "
                        f"{100 * (np.ptp(own) / np.ptp(true) - 1):+.2f} | {1e6 * np.abs(own - true).max():.3f} | "
                        + " | ".join(levels)
                        + " |"
                    )
    return [*lines, ""] if len(lines) > 4 else []


def convergence(study: str, finer: Record) -> list[str]:
    """What finer meshes do to the reference."""
    which = CONVERGENCE[study]
    lines = [
        f"**Mesh of the reference: {study}, {which.condition}; deflection on the mesh used, and its change on others**",
        "",
        "| in contact | mesh periods | mesh | " + " | ".join(f"{t:g} N m" for t in TORQUES) + " |",
        "|---|---:|---|" + "---:|" * len(TORQUES),
    ]
    used, *others = which.variants
    for name, place in which.places.items():
        key = f"{place:.9g}"
        if key not in finer.get(used, {}):
            continue
        base = np.array(finer[used][key])
        lines.append(f"| {name} | {place:.3f} | {used} | " + " | ".join(f"{1e6 * d:.3f} µm" for d in base) + " |")
        for other in (o for o in others if key in finer.get(o, {})):
            change = 100 * (np.array(finer[other][key]) / base - 1)
            lines.append(f"| {name} | {place:.3f} | {other} | " + " | ".join(f"{c:+.2f} %" for c in change) + " |")
    return [*lines, ""] if len(lines) > 4 else []


SHOWN = (("spur", "3 slots"), ("stage1", "5 slots"))
"""Study and blank drawn; the first tooth over which each is looked at."""


def figure(data: dict[str, Record], out: Path) -> None:
    """Deflection over the mesh period: reference, and the hybrid with and without tip edges."""
    shown = [(study, blank) for study, blank in SHOWN if curves(study, blank, data[study], out)]
    if not shown:
        return
    fig = Figure(figsize=(4.5 * len(shown), 7.5), layout="constrained")
    axes = fig.subplots(len(TORQUES), len(shown), squeeze=False)
    for column, (study, blank) in enumerate(shown):
        s = STUDIES[study]()
        reference, hybrid = next(iter(curves(study, blank, data[study], out).values()))
        place = np.arange(s.angles + 1) / s.angles
        for row, torque in enumerate(TORQUES):
            ax = axes[len(TORQUES) - 1 - row, column]
            for values, label, style in (
                (reference, "reference", "k.-"),
                (hybrid[CORNER_GAPS[-1]], "hybrid, tip edges", "C0-"),
                (hybrid[CORNER_GAPS[0]], "hybrid, path alone", "C3--"),
            ):
                curve = 1e6 * values[:, row]
                ax.plot(place, np.append(curve, np.nan), style, label=label, linewidth=1)
            ax.set_title(f"{study}, {blank}, {torque:g} N m", fontsize=9)
            ax.set_ylabel("deflection / µm")
        axes[-1, column].set_xlabel("mesh periods")
    axes[0, 0].legend(fontsize=8)
    fig.savefig(MEASURED / "gear" / "reference_contact.png", dpi=110)


def write_relieved(out: Path) -> None:
    """Regression data of the relieved pair, if there are any."""
    files = {name: out / f"relieved, {name}" for name in RELIEVED}
    if not all(file.exists() for file in files.values()):
        return
    s = STUDIES["spur"]()
    data = {
        "made_by": "benchmarks/gear/reference_contact.py",
        "note": THICK_TEETH,
        "pinion": macro(s.pair.pinion.geometry),
        "wheel": macro(s.pair.wheel.geometry),
        "centre_distance": s.pair.centre_distance,
        "width_layers": RELIEVED_LAYERS,
        "resolution": asdict(RELIEVED_RESOLUTION),
        "points": {name: asdict(RELIEVED[name]) | pickle.loads(file.read_bytes()) for name, file in files.items()},
    }
    (DATA / "reference_relief.json").write_text(json.dumps(data, indent=1) + "\n")


def write(out: Path) -> None:
    """Regression data from what there is, and the page where the hybrid's deflections are there for all of it."""
    DATA.mkdir(parents=True, exist_ok=True)
    lines = [
        "Deflection δ along the flank normal, reference contact (finite "
        "elements with refined flanks alone) against the hybrid contact on the same body mesh, of at most 8 layers; "
        "pure involutes. Misalignment is of the wheel's axis in the plane of action, a lead slope on its drive flanks. "
        "The error of the mean is relative to the mean of δ beyond where the unloaded flanks touch. Mesh harmonics of "
        "the mesh period looked at, hybrid over reference.",
        "",
        THICK_TEETH,
        "",
    ]
    write_relieved(out)
    data = {study: regression(study, out) for study in STUDIES}
    known = {study: record for study, record in data.items() if record["blanks"] or record["misaligned"]}
    for study, record in known.items():
        data_file(study).write_text(json.dumps(record, indent=1) + "\n")
    missing = [
        name
        for study, record in known.items()
        for condition in (*record["blanks"], *record["misaligned"])
        if not (out / (name := f"{study}-hybrid, {condition}")).exists()
    ]
    if missing:
        print("docs/measured/gear/reference_contact.md stays as it is, without", "; ".join(missing))
        return
    for study, record in known.items():
        lines += comparison(study, record, out)
    for study in CONVERGENCE:
        lines += convergence(study, data[study]["finer"])
    figure(data, out)
    publish("gear/reference_contact", "\n".join(lines))
