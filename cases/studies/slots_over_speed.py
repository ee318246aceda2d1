"""Slotted against solid gear 2 over speed: the difference of their sound, and the changes that turn its sign.

python cases/studies/slots_over_speed.py OUT [publish]

Steady states of cases/gearbox between 500 and 3000 rpm at `draft`, the case as it is at some speeds at `standard` too.
Torque, damping of housing and bearings, and a rotor on the input are changed one at a time. Mesh laws, housing and
transfer vectors are computed once, in OUT/operators; levels stay in OUT/levels-<fidelity>.json, so that a stopped run
goes on. Writes two figures to OUT; with `publish` the page and the figures go to the documentation.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import nvhchain as nvh
from nvhchain import levels
from nvhchain.acoustics import modal_pressure, modal_transfer_vectors
from nvhchain.case import FieldPoint, GearboxCase
from nvhchain.chain import Result
from nvhchain.error_band import format_limits
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import FieldPressure, FloatArray
from nvhchain.plots._style import COLOURS, panels, styled

CASES = Path(__file__).parents[1] / "gearbox"
DESIGNS = ("solid", "slotted")
SPEEDS = tuple(range(500, 3001, 100))
"""rpm of the input; half-power bandwidths of the housing are 4 % of the frequency, 60 rpm at the middle."""
SELECTED = SPEEDS[::5]
"""rpm at which the confidence limits are found and the page gives levels in parts."""
CHECKED = tuple(rpm for rpm in SELECTED if rpm >= 1000)
"""rpm at which `standard` is computed: records of slow shafts are long, that of 500 rpm five times that of 2500."""
FAINT = 1e-4
"""Of the strongest line of the bearing forces: lines below are not followed further."""
MICROPHONES = {  # m, 1 m from the sides of a casting of 0.45 × 0.30 × 0.24 m; the first one is the case's
    "behind": (0.13, -0.02, 1.227),
    "beside": (1.379, -0.02, 0.12),
    "above": (0.13, 1.137, 0.12),
}
NARROW = 4000.0
"""Hz: end of a narrower band, for the weight of the lines near the end of the band."""
PLACES = (*MICROPHONES, f"behind, up to {NARROW / 1000:g} kHz only")


@dataclass(frozen=True)
class Change:
    """Departure from the case.

    torque: input torque, N m.  housing_damping: fraction of critical, of every mode.  bearing_damping: factor.  rotor:
    inertia coupled to the input shaft, kg m².  None: as in the case.
    """

    torque: float | None = None
    housing_damping: float | None = None
    bearing_damping: float = 1.0
    rotor: float = 0.0

    def of(self, case: GearboxCase) -> GearboxCase:
        """The changed case, without its housing."""
        torque = case.operation.input_torque if self.torque is None else self.torque
        shafts = tuple(
            replace(shaft, coupled_inertia=self.rotor if shaft.name == case.input_shaft else 0.0)
            for shaft in case.shafts
        )
        bearings = tuple(
            replace(
                bearing,
                radial_damping=self.bearing_damping * bearing.radial_damping,
                axial_damping=self.bearing_damping * bearing.axial_damping,
            )
            for bearing in case.bearings
        )
        return replace(case, operation=replace(case.operation, input_torque=torque), shafts=shafts, bearings=bearings)


AS_IT_IS = "as the case is"
ROTOR = "rotor on the input"
CHANGES = {
    "input torque": {"100 N m": Change(torque=100.0), "400 N m": Change(torque=400.0)},
    "damping of the housing": {"1 %": Change(housing_damping=0.01), "4 %": Change(housing_damping=0.04)},
    "damping of the bearings": {"half": Change(bearing_damping=0.5), "double": Change(bearing_damping=2.0)},
    ROTOR: {"0.005 kg m²": Change(rotor=0.005), "0.02 kg m²": Change(rotor=0.02)},
}
USUAL = {"input torque": "250 N m", "damping of the housing": "2 %", "damping of the bearings": "as it is"}
USUAL |= {ROTOR: "none"}

ALL_CHANGES = {AS_IT_IS: Change()} | {
    f"{group} {value}": change for group, changes in CHANGES.items() for value, change in changes.items()
}

Levels = dict[str, dict[str, list[float]]]
"""Change → `design rpm` → dB(A) at the microphones, then of the `parts` of the sound at the first one."""


def loaded(design: str) -> GearboxCase:
    """The case of a design, heard from all sides."""
    case = nvh.load_case(CASES / f"{design}.toml")
    assert isinstance(case, GearboxCase)
    assert case.field_points[0].position == MICROPHONES["behind"], "the first microphone is not the case's"
    return replace(case, field_points=tuple(FieldPoint(name, at) for name, at in MICROPHONES.items()))


def alone(case: GearboxCase) -> GearboxCase:
    """The case at its first microphone only."""
    return replace(case, field_points=case.field_points[:1])


def at(case: GearboxCase, rpm: float) -> GearboxCase:
    """The case at another speed."""
    return replace(case, operation=replace(case.operation, input_speed=rpm * pi / 30.0))


def heard(
    case: GearboxCase, changes: dict[str, Change], operators: Result, fidelity: Fidelity
) -> dict[str, list[float]]:
    """By change, dB(A) at the microphones and of the `parts` of the sound at the first one.

    The states share modal transfer vectors at the lines that carry force in any of them.
    """
    assert operators.housing is not None
    assert operators.transfer_vectors is not None
    spectra, housings = {}, {}
    for title, change in changes.items():
        housing = operators.housing
        if change.housing_damping is not None:
            housing = housing.replace(modal_damping=np.full_like(housing.modal_damping, change.housing_damping))
        asked = replace(change.of(case), quantities=("bearing_forces",))
        run = nvh.run(asked, fidelity=fidelity, mesh_laws=operators.mesh_laws, housing=housing)
        assert run.force_spectrum is not None
        spectra[title], housings[title] = run.force_spectrum, housing
    size = np.array([np.abs(of.force).max(axis=(1, 2)) for of in spectra.values()])
    loud = (size > FAINT * size.max(axis=1, keepdims=True)).any(axis=0)
    lines = next(iter(spectra.values())).frequency[loud]
    modal = modal_transfer_vectors(operators.transfer_vectors, operators.housing, lines, fidelity=fidelity.acoustics)
    found = {}
    for title, of in spectra.items():
        forces = of.replace(frequency=of.frequency[loud], force=of.force[loud])
        shapes = modal.replace(housing=housings[title].content_hash)  # damping leaves shapes as they are
        sound = modal_pressure(shapes, housings[title], forces)
        found[title] = [*levels.overall(sound.frequency, sound.pressure).tolist(), *parts(case, sound)]
    return found


def parts(case: GearboxCase, sound: FieldPressure) -> list[float]:
    """dB(A) at the first microphone: up to `NARROW`, mesh orders of stage 1, of stage 2 alone, and all other lines."""
    order = sound.frequency * 2.0 * pi / sound.input_speed
    first, second = (np.abs(order / float(n) - np.round(order / float(n))) < 1e-4 for n in case.mesh_orders.values())
    return [
        float(levels.overall(sound.frequency[among], sound.pressure[among, 0])) if among.any() else -np.inf
        for among in (sound.frequency <= NARROW, first, second & ~first, ~first & ~second)
    ]


def limits(case: GearboxCase, fidelity: Fidelity, operators: Path) -> list[float]:
    """Confidence limits of the overall level at the first microphone, dB(A)."""
    lower, upper = nvh.run(alone(case), fidelity=fidelity, operators=operators).error_band.overall[0]
    return [float(lower), float(upper)]


def measure(
    out: Path,
    fidelity: Fidelity,
    designs: Mapping[str, GearboxCase],
    speeds: Sequence[int],
    changes: Mapping[str, Change],
) -> dict[str, Any]:
    """Levels under every change, and limits at SELECTED speeds: those that OUT holds and what it lacks.

    Kept after every speed.  seconds: processor time beside the operators.
    """
    record = out / f"levels-{fidelity.name}.json"
    found: dict[str, Any] = json.loads(record.read_text()) if record.exists() else {"seconds": 0.0, "limits": {}}
    operators: dict[str, Result] = {}
    for rpm in speeds:
        seconds = 0.0
        for name, case in designs.items():
            key, steady = f"{name} {rpm}", at(case, rpm)
            missing = {title: change for title, change in changes.items() if key not in found.get(title, {})}
            if missing and name not in operators:
                operators[name] = nvh.run(case, fidelity=fidelity, operators=out / "operators")
            start = time.process_time()
            for title, each in (heard(steady, missing, operators[name], fidelity) if missing else {}).items():
                found.setdefault(title, {})[key] = each
            if rpm in SELECTED and key not in found["limits"]:
                found["limits"][key] = limits(steady, fidelity, out / "operators")
            seconds += time.process_time() - start
        found["seconds"] += seconds
        record.write_text(json.dumps(found))
    return found


def level(found: Levels, title: str, design: str, place: int = 0, speeds: Sequence[int] = SPEEDS) -> FloatArray:
    """dB(A) over speeds at a microphone."""
    return np.array([found[title][f"{design} {rpm}"][place] for rpm in speeds])


def difference(found: Levels, title: str, place: int = 0, speeds: Sequence[int] = SPEEDS) -> FloatArray:
    """Slotted − solid over speeds, dB."""
    return level(found, title, "slotted", place, speeds) - level(found, title, "solid", place, speeds)


def energy_mean(of: FloatArray) -> float:
    """Level of the mean energy, dB."""
    return float(10.0 * np.log10(np.mean(10.0 ** (of / 10.0))))


HEAD = "mean energy / dB | median / dB | at 2500 rpm / dB | lowest / dB, rpm | highest / dB, rpm | slotted louder |"


def row(name: str, solid: FloatArray, slotted: FloatArray) -> str:
    """A line of a table: slotted − solid over SPEEDS."""
    by = slotted - solid
    low, high = int(by.argmin()), int(by.argmax())
    cells = [
        name,
        f"{energy_mean(slotted) - energy_mean(solid):+.1f}",
        f"{np.median(by):+.1f}",
        f"{by[SPEEDS.index(2500)]:+.1f}",
        f"{by[low]:+.1f} at {SPEEDS[low]}",
        f"{by[high]:+.1f} at {SPEEDS[high]}",
        f"{int((by > 0).sum())} of {len(by)}",
    ]
    return "| " + " | ".join(cells) + " |"


def table(found: Levels) -> list[str]:
    """Slotted − solid at the case's microphone, change by change."""
    return [
        f"| changed | {HEAD}",
        "|---|" + 6 * "---:|",
        *(row(title, *(level(found, title, name) for name in DESIGNS)) for title in ALL_CHANGES),
    ]


def places(found: Levels) -> list[str]:
    """Slotted − solid of the case as it is, microphone by microphone, and in a narrower band."""
    return [
        f"| microphone | {HEAD}",
        "|---|" + 6 * "---:|",
        *(row(place, *(level(found, AS_IT_IS, name, i) for name in DESIGNS)) for i, place in enumerate(PLACES)),
    ]


def composition(found: dict[str, Any], closer: dict[str, Any]) -> list[str]:
    """Levels of both designs, limits and parts of the sound at SELECTED speeds, with what `closer` makes of them."""
    head = (
        "input speed / rpm | overall | limits | up to 4 kHz | mesh orders of stage 1 | of stage 2 | all other lines |"
    )
    lines = [f"| design | {head} overall, `standard` | limits |", "|---|" + 9 * "---:|"]
    for rpm in SELECTED:
        for name in DESIGNS:
            key = f"{name} {rpm}"
            overall, split = found[AS_IT_IS][key][0], found[AS_IT_IS][key][len(MICROPHONES) :]
            cells = [name, str(rpm), f"{overall:.1f}", format_limits(found["limits"][key])]
            cells += [f"{part:.1f}" for part in split]
            cells += (
                [f"{closer[AS_IT_IS][key][0]:.1f}", format_limits(closer["limits"][key])]
                if rpm in CHECKED
                else ["", ""]
            )
            lines.append("| " + " | ".join(cells) + " |")
    return lines


def apart(found: dict[str, Any], speeds: Sequence[int]) -> int:
    """Number of speeds at which the limits of the two designs do not overlap."""
    solid, slotted = (np.array([found["limits"][f"{name} {rpm}"] for rpm in speeds]) for name in DESIGNS)
    return int(((slotted[:, 0] > solid[:, 1]) | (slotted[:, 1] < solid[:, 0])).sum())


def page(found: dict[str, Any], closer: dict[str, Any]) -> str:
    """Tables and their reading."""
    checked = difference(closer, AS_IT_IS, speeds=CHECKED)
    moved = np.abs(checked - difference(found, AS_IT_IS, speeds=CHECKED)).max()
    return "\n".join(
        [
            "Written by `cases/studies/slots_over_speed.py`: the gearbox of the examples, gear 2 with five slots and "
            f"solid, at {len(SPEEDS)} steady speeds of the input from {SPEEDS[0]} to {SPEEDS[-1]} rpm, at `draft`. "
            "Levels in dB(A) 1 m behind the rear wall, 50 to 5000 Hz. One thing is changed at a time; mesh laws, "
            "housing and transfer vectors are shared (laws reach three times the load of 250 N m).",
            "",
            "Slotted − solid. Mean energy: of all speeds, equally weighted.",
            "",
            *table(found),
            "",
            "![Slotted − solid over speed, change by change](slots_over_speed.png)",
            "",
            "The case as it is, 1 m from three sides, and in a narrower band:",
            "",
            *places(found),
            "",
            "Levels / dB(A), the limits within which `reference` is expected, and the parts that make the levels up:",
            "",
            *composition(found, closer),
            "",
            f"At `standard` the difference is {', '.join(f'{by:+.1f}' for by in checked)} dB at "
            f"{', '.join(map(str, CHECKED))} rpm, at most {moved:.1f} dB from that at `draft`. The limits of the two "
            f"designs are apart at {apart(found, SELECTED)} of {len(SELECTED)} speeds at `draft` and at "
            f"{apart(closer, CHECKED)} of {len(CHECKED)} at `standard`: they are limits of a level, whose errors in "
            "housing and acoustics both designs share, and do not separate the designs by themselves.",
            "",
            f"{len(SPEEDS) * len(DESIGNS) * len(ALL_CHANGES)} steady states and the limits took "
            f"{found['seconds'] / 60:.0f} min of processor time at `draft`, beside the operators.",
            "",
        ]
    )


@styled
def over_speed(found: dict[str, Any], closer: dict[str, Any]) -> Figure:
    """Levels of both designs over speed, and their difference under every change."""
    axes = panels(2, None, height=3.3, share="x")
    for index, name in enumerate(DESIGNS):
        axes[0].plot(SPEEDS, level(found, AS_IT_IS, name), color=COLOURS[index], label=f"gear 2 {name}, draft")
        points = level(closer, AS_IT_IS, name, speeds=CHECKED)
        axes[0].plot(CHECKED, points, "o", color=COLOURS[index], label=f"{name}, standard")
    axes[0].set_ylabel("$L_{pA}$ / dB re 20 µPa")
    axes[0].legend(ncols=2, loc="lower right")
    every = np.array([difference(found, title) for title in ALL_CHANGES])
    rotor = np.array([title.startswith(ROTOR) for title in ALL_CHANGES])
    low, high = every[~rotor].min(axis=0), every[~rotor].max(axis=0)
    axes[1].fill_between(SPEEDS, low, high, color="#D9D9D9", label="range with other torque or damping")
    axes[1].plot(SPEEDS, every[0], color="black", label=AS_IT_IS)
    axes[1].plot(
        SPEEDS,
        difference(found, AS_IT_IS, len(MICROPHONES)),
        "--",
        color="black",
        label=f"up to {NARROW / 1000:g} kHz only",
    )
    axes[1].plot(SPEEDS, every[-1], color=COLOURS[3], linewidth=1.0, label="with a rotor of 0.02 kg m² on the input")
    axes[1].axhline(0.0, color="#8C8C8C", linewidth=1.0)
    axes[1].set_ylabel("slotted − solid / dB")
    axes[1].set_xlabel("input speed / rpm")
    axes[1].set_xlim(SPEEDS[0], SPEEDS[-1])
    axes[1].legend(loc="best")
    figure = axes[0].figure
    assert isinstance(figure, Figure)
    return figure


@styled
def change_by_change(found: dict[str, Any]) -> Figure:
    """The difference over speed, one panel per thing that is changed."""
    axes = panels(len(CHANGES), None, columns=2, height=2.8, width=13.0)
    for ax, (group, changes) in zip(axes, CHANGES.items(), strict=True):
        ax.plot(SPEEDS, difference(found, AS_IT_IS), color="black", label=USUAL[group])
        for index, value in enumerate(changes):
            ax.plot(SPEEDS, difference(found, f"{group} {value}"), color=COLOURS[index], linewidth=1.2, label=value)
        ax.axhline(0.0, color="#8C8C8C", linewidth=1.0)
        ax.set_title(group, loc="left")
        ax.legend(ncols=3, loc="lower left")
        ax.set_xlim(SPEEDS[0], SPEEDS[-1])
    for ax in axes[::2]:
        ax.set_ylabel("slotted − solid / dB")
    for ax in axes[-2:]:
        ax.set_xlabel("input speed / rpm")
    figure = axes[0].figure
    assert isinstance(figure, Figure)
    return figure


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    designs = {name: loaded(name) for name in DESIGNS}
    found = measure(out, nvh.DRAFT, designs, SPEEDS, ALL_CHANGES)
    heard_alone = {name: alone(case) for name, case in designs.items()}
    closer = measure(out, nvh.STANDARD, heard_alone, CHECKED, {AS_IT_IS: Change()})
    text = page(found, closer)
    levels_over_speed, differences = over_speed(found, closer), change_by_change(found)
    levels_over_speed.savefig(out / "level_over_speed.png", dpi=100)
    differences.savefig(out / "slots_over_speed.png", dpi=80)
    if sys.argv[2:] == ["publish"]:
        sys.path.insert(0, str(CASES.parents[1]))
        from benchmarks.publish import MEASURED, publish

        publish("chain/slots_over_speed", text)
        differences.savefig(MEASURED / "chain" / "slots_over_speed.png", dpi=80)
        levels_over_speed.savefig(MEASURED.parent / "_static" / "level_over_speed.png", dpi=100)
    else:
        print(text)
    quieter = [rpm for rpm, by in zip(SPEEDS, difference(found, AS_IT_IS), strict=True) if by < 0]
    assert not quieter, f"slotted is the quieter design at {quieter} rpm"


if __name__ == "__main__":
    main()
