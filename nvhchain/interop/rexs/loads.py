"""Load cases of a document: speed and torque where power enters, and where it leaves."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from nvhchain.interop.rexs.contents.document import Attribute, Component, LoadCase
from nvhchain.interop.rexs.contents.values import Values
from nvhchain.interop.rexs.parts import Parts
from nvhchain.interop.rexs.places import Line, base_frame, frame_of
from nvhchain.interop.rexs.shafts import place_on_shaft
from nvhchain.interop.rexs.unit import ImportedLoad, ImportedSideLoad


@dataclass(frozen=True)
class Power:
    """Flow of power through the unit.

    input_shaft, output_shaft: shafts.
    rotation: rotation of the input about +z.
    loads: load cases, the chosen one first.
    """

    input_shaft: int
    output_shaft: int
    rotation: int
    loads: tuple[ImportedLoad, ...]


@dataclass(frozen=True)
class _State:
    """Speeds (rad/s) and torques (N m) by shaft, about the shafts' own u axes; `share` of the operating time."""

    name: str
    speeds: dict[int, float]
    torques: dict[int, float]
    share: float | None


def read_power(
    parts: Parts,
    turns: Mapping[int, Fraction],
    lines: Mapping[int, Line],
    chosen: str | None,
    passed: Collection[int] = (),
) -> Power:
    """Return input, output and load cases.

    turns: turns of every shaft about +z, for one turn of the first.
    chosen: load case, by its number; the first by default.
    passed: shafts that pass power on; without a load they are neither input nor output.
    """
    cases: list[LoadCase | None] = [*parts.document.load_cases] or [None]
    states = [_state(parts, case, turns, lines) for case in cases]
    known = [state.name for state in states]
    if chosen is not None and chosen not in known:
        parts.findings.refuse(f"load case {chosen!r} is not in the file: choose one of {', '.join(known)}")
    states.sort(key=lambda state: state.name != chosen if chosen is not None else False)
    input_shaft, output_shaft, rotation, signed = _ends(parts, states[0], turns, passed)
    loads = tuple(_load(state, states[0], turns, (input_shaft, output_shaft), signed=signed) for state in states)
    return Power(input_shaft, output_shaft, rotation if rotation else 1, loads)


def _state(parts: Parts, case: LoadCase | None, turns: Mapping[int, Fraction], lines: Mapping[int, Line]) -> _State:
    """Return speeds and torques of a load case, or of the components themselves.

    A power becomes a torque by the speed of its shaft, which follows from that of any other one.
    """

    def reader(component: Component) -> Values:
        own: dict[str, Attribute] = dict(component.attributes)
        if case is not None:
            own |= case.components.get(component.id, {})
        return Values(component, parts.findings, own)

    speeds: dict[int, float] = {}
    torques: dict[int, float] = {}
    for shaft in parts.rotor:
        sign = lines[shaft].direction if shaft in lines else 1
        speed = reader(parts.document.components[shaft]).number("rotational_speed", "rad/s", low=-2e4, high=2e4)
        if speed:
            speeds[parts.rotor[shaft]] = sign * speed
    spin = _spin(speeds, turns)
    for load in parts.document.typed("external_load"):
        values = reader(load)
        torque = values.number("torque_around_u_axis", "N m", low=-1e8, high=1e8)
        power = values.number("power", "W")
        owner = parts.document.owner(load.id, "shaft")
        if owner is None:
            parts.findings.add("excluded", load.label, "load", "on no shaft", "no relation `assembly` with one")
        if owner is None or values.flag("transmits_torque") is False:
            continue
        rotor, sign = parts.rotor[owner.id], lines[owner.id].direction if owner.id in lines else 1
        speed = speeds.get(rotor) or spin * float(turns.get(rotor, 0))
        if not torque and power and speed:
            torque = power / speed * sign
        if torque:
            torques[rotor] = torques.get(rotor, 0.0) + sign * torque
    units = parts.document.typed("gear_unit")
    share = reader(units[0]).number("operating_time_fraction") if units else None
    return _State(case.name if case else "", speeds, torques, share)


def read_side_loads(parts: Parts, lines: Mapping[int, Line], chosen: str) -> tuple[ImportedSideLoad, ...]:
    """Return the transverse and axial forces of external loads in a load case, in the frame of the case.

    chosen : load case, by its number.
    """
    cases = {case.name: case.components for case in parts.document.load_cases}
    frames = {shaft: frame_of(parts, parts.document.components[shaft]) for shaft in lines}
    base = base_frame(parts, lines)
    found = []
    for load in parts.document.typed("external_load"):
        values = Values(load, parts.findings, dict(load.attributes) | cases.get(chosen, {}).get(load.id, {}))
        force, moment = (
            np.array([values.number(name.format(axis), unit, low=-1e8, high=1e8) or 0.0 for axis in "uvw"])
            for name, unit in (("force_{}_direction", "N"), ("torque_around_{}_axis", "N m"))
        )
        moment[0] = 0.0  # that of the power
        owner = parts.document.owner(load.id, "shaft")
        if owner is None or not (force.any() or moment.any()):
            continue
        z, frame = place_on_shaft(parts, load, owner.id, lines), frames.get(owner.id)
        if z is None or frame is None or base is None:
            text = f"{np.linalg.norm(force):.6g} N, {np.linalg.norm(moment):.6g} N m"
            parts.findings.add("excluded", load.label, "side load", text, "its place on the shaft is missing")
            continue
        turn = base.axes @ frame.axes.T  # u, v, w of the shaft to those of the first one
        fz, fx, fy = (turn @ force).tolist()
        _, mx, my = (turn @ moment).tolist()
        found.append(ImportedSideLoad(parts.names[parts.rotor[owner.id]], z, (fx, fy, fz), (mx, my)))
    return tuple(found)


def _spin(speeds: Mapping[int, float], turns: Mapping[int, Fraction]) -> float:
    """Return the speed (rad/s) for one turn of `turns`; 0 without any speed."""
    return next((speed / float(turns[shaft]) for shaft, speed in speeds.items() if turns.get(shaft)), 0.0)


def _ends(
    parts: Parts, state: _State, turns: Mapping[int, Fraction], passed: Collection[int]
) -> tuple[int, int, int, bool]:
    """Return input, output, rotation of the input, and True for torques with sign; record what is assumed."""
    record, document = parts.findings, parts.document
    rotors = [shaft for shaft in parts.shafts() if shaft in turns] or parts.shafts()
    spin = _spin(state.speeds, turns)
    loaded = [
        parts.rotor[owner.id]
        for load in document.typed("external_load")
        if parts.values(load).flag("transmits_torque") is not False
        and (owner := document.owner(load.id, "shaft")) is not None
        and parts.rotor[owner.id] in rotors
    ]
    powers = {shaft: torque * spin * float(turns.get(shaft, 0)) for shaft, torque in state.torques.items()}
    entering = [shaft for shaft, power in powers.items() if power > 0]
    leaving = [shaft for shaft, power in powers.items() if power < 0]
    others = [shaft for shaft in dict.fromkeys(loaded)]
    fastest = sorted(rotors, key=lambda shaft: -abs(turns.get(shaft, Fraction(0))))
    ends = [shaft for shaft in fastest if shaft not in passed] or fastest
    alike = sorted(entering or leaving, key=fastest.index)
    # REXS 1.0 states torques without sign, of all loaded shafts; a motor without one takes the balance
    signed = not (len(alike) > 1 and not (entering and leaving) and set(others) <= set(alike))
    for shafts, verb in ((entering, "enters"), (leaving, "leaves")):
        largest = max((abs(powers[shaft]) for shaft in shafts), default=0.0)
        named = [parts.names[shaft] for shaft in shafts if abs(powers[shaft]) > 1e-3 * largest]
        if signed and len(named) > 1:
            record.refuse(
                f"power {verb} at shafts {', '.join(named)}: a case has one input and one output; leave all of these "
                "loads but one out, or import each path by itself"
            )
    if not signed:
        entering, leaving = alike[:1], alike[-1:]
        record.add("assumed", "operation", "input shaft", parts.names[alike[0]], "the fastest; all torques drive")
    input_shaft = entering[0] if entering else next((s for s in others if s not in leaving), None)
    if input_shaft is None:
        input_shaft = next((shaft for shaft in (*ends, *fastest) if shaft not in leaving[:1]), fastest[0])
        record.add("assumed", "operation", "input shaft", parts.names[input_shaft], "the fastest end; no load names it")
    output_shaft = leaving[0] if leaving else next((shaft for shaft in others if shaft != input_shaft), input_shaft)
    if output_shaft == input_shaft:
        output_shaft = next(
            (shaft for shaft in (*reversed(ends), *reversed(fastest)) if shaft != input_shaft), input_shaft
        )
        record.add(
            "assumed", "operation", "output shaft", parts.names[output_shaft], "the slowest end; no load names it"
        )
    sense = spin * float(turns.get(input_shaft, 0))
    if not sense:
        record.add("assumed", "operation", "rotation of the input", "+1 about its axis", "no speed in the file")
    return input_shaft, output_shaft, 1 if sense >= 0 else -1, signed


def _load(
    state: _State, first: _State, turns: Mapping[int, Fraction], ends: tuple[int, int], *, signed: bool
) -> ImportedLoad:
    """Return speed and torque of the input, carried over from another shaft where needed.

    Where power leaves at the input, or enters at the output, the unit coasts and the torque is negative.

    first : state by which input and output were found; its rotation is that of a state without speed.
    ends : input and output.
    signed : False for torques without sign, which all drive.
    """
    input_shaft, output_shaft = ends

    def ratio(shaft: int) -> float:
        return abs(float(turns.get(shaft, 0)) / float(turns[input_shaft])) if turns.get(input_shaft) else 0.0

    speed = next((abs(value) / ratio(shaft) for shaft, value in state.speeds.items() if ratio(shaft)), None)
    if input_shaft in state.speeds:
        speed = abs(state.speeds[input_shaft])
    torque = None
    spin, usual = _spin(state.speeds, turns), _spin(first.speeds, turns)
    turned = spin * usual < 0.0
    for shaft, factor, way in ((input_shaft, 1.0, 1.0), (output_shaft, ratio(output_shaft), -1.0)):
        if torque is None and shaft in state.torques and factor:
            # without any speed, the first state drives
            turning = way * (spin or usual) * float(turns.get(shaft, 0)) or first.torques.get(shaft, 0.0)
            coasts = signed and state.torques[shaft] * turning < 0.0
            torque = abs(state.torques[shaft]) * factor * (-1.0 if coasts else 1.0)
    return ImportedLoad(state.name, speed, torque, state.share, reversed=turned)
