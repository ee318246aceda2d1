"""Options that would change the dynamics of a case, each with its reason and its measured effect.

`plan` and `check` print them; they are never switched on automatically.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt

import numpy as np

from nvhchain import gear
from nvhchain.case import GearboxCase
from nvhchain.dynamics import Bearing, Shaft
from nvhchain.dynamics.model.shaft_beam import elastic_shaft
from nvhchain.errors import InputError
from nvhchain.scene.bearing_lines import constant_bearings

MEASURED = {"friction": 13.1, "shuttling": 15.7, "flexible_shafts": -27.3, "gyroscopic": -0.003}
"""Change (dB) of the worst mesh harmonic of the example gearbox's bearing forces at 2500 rpm, by option.

Source: docs/measured/dynamics/options.md.
"""
NOTICED_SWING = 1e-3
"""Smallest reported motion of a mesh's load along the face, relative to the distance of the shaft's bearings.

0.05 % of the mesh force then alternates at each bearing. A mesh stiffness that varies by 2 % has an effect some 30 dB
larger.
"""
NOTICED_SPLIT = 0.1
"""Smallest reported split of a tilting frequency by gyroscopic terms, relative to this frequency.

It is the width of a resonance with 5 % damping, as bearings damp tilting. A split of 5 % (the example at 20 000 rpm)
changes the result by a few hundredths of a decibel (benchmarks/dynamics/options.py, `speeds`).
"""
NOTICED_GIVE = 0.1
"""Smallest reported bending of a shaft, relative to the deflection of its bearings under the gear.

It changes a natural frequency by 5 %.
"""
ANGLES, SLICES = 24, 32
"""Numbers of angles in a mesh period and of slices of the face for the contact lines."""
ELEMENT = 1.0
"""Length (m) of a beam element; the static deflection at its nodes is exact for any length."""


def advice(case: GearboxCase) -> tuple[str, ...]:
    """Return one sentence per option that is off and would change the result, and one for undamped bearings."""
    options = case.options
    considered = (
        (options.friction > 0.0, _friction),
        (options.shuttling, _shuttling),
        (options.flexible_shafts, _flexible),
        (options.gyroscopic, _gyroscopic),
    )
    undamped = [
        bearing.name
        for bearing in case.bearings
        if not (bearing.radial_damping or bearing.axial_damping or bearing.stiffness_damping or bearing.loss_factor)
    ]
    first = (f"bearings without damping ({', '.join(undamped)}): radial_damping and axial_damping",) if undamped else ()
    return first + tuple(
        f"{why}: options.{name} (in the example {MEASURED[name]:+g} dB at the worst mesh harmonic)"
        for on, reasons in considered
        if not on
        for name, why in reasons(case)
    )


def _friction(case: GearboxCase) -> Iterator[tuple[str, str]]:
    yield "friction", "friction of the flanks is left out, since its coefficient is not known"


def _shuttling(case: GearboxCase) -> Iterator[tuple[str, str]]:
    gears = {item.name: item.shaft for item in case.gears}
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        swing = load_swing(pair)
        span = min(_span(case.gearbox.bearings_of(gears[name])) for name in (stage.pinion, stage.wheel))
        if swing > NOTICED_SWING * span:
            yield (
                "shuttling",
                f"stage {stage.name}: helical, its load moves by {1e3 * swing:.2g} mm along the face, "
                f"{100 * swing / span:.1f} % of the distance of the bearings",
            )


def load_swing(pair: gear.GearPair) -> float:
    """Return the motion (m) of the centre of all contact lines along the face in a mesh period, for an even load."""
    middle = []
    for angle in np.arange(ANGLES) * pair.mesh_period / ANGLES:
        lines = gear.contact_lines(pair, float(angle), slices=SLICES)
        middle.append(float(lines.length @ lines.axial) / float(lines.length.sum()))
    return float(np.ptp(middle))


def _flexible(case: GearboxCase) -> Iterator[tuple[str, str]]:
    for shaft in case.shafts:
        places = [item.z for item in case.gears if item.shaft == shaft.name]
        bearings = _bearings_of(case, shaft.name)
        give = max((bending_share(shaft, bearings, z) for z in places), default=0.0)
        if give > NOTICED_GIVE:
            yield (
                "flexible_shafts",
                f"shaft {shaft.name} bends under its gears by {100 * give:.0f} % of what its bearings give way",
            )


def bending_share(shaft: Shaft, bearings: list[Bearing], z: float) -> float:
    """Return the additional deflection of a shaft at `z` (m) under a radial force there, relative to a rigid shaft.

    Both shafts run in the same bearings. The value is 0 for a shaft whose segments do not reach `z` or a bearing: it
    cannot be modelled as flexible.
    """
    push = np.eye(6)[0]
    try:
        elastic = elastic_shaft(shaft, [(z, push), *((b.z, push) for b in bearings)], element=ELEMENT, frequency=0.0)
    except InputError:
        return 0.0

    def shapes_at(place: float) -> np.ndarray:
        return np.concatenate([[1.0, place], elastic.motion_at(place)[0]])

    stiffness = np.diag(np.concatenate([np.zeros(2), elastic.squared]))
    for bearing in bearings:
        stiffness += bearing.radial_stiffness * np.outer(shapes_at(bearing.z), shapes_at(bearing.z))
    rigid = shapes_at(z)[:2] @ np.linalg.solve(stiffness[:2, :2], shapes_at(z)[:2])
    return float(shapes_at(z) @ np.linalg.solve(stiffness, shapes_at(z)) / rigid - 1.0)


def _gyroscopic(case: GearboxCase) -> Iterator[tuple[str, str]]:
    ramp = case.operation.ramp
    fastest = max(case.operation.input_speed, ramp.end_speed if ramp else 0.0)
    for shaft in case.gearbox_with_gears.shafts:
        body, speed = shaft.inertia(), fastest * float(case.shaft_orders.get(shaft.name, 0))
        tilting = sum(b.radial_stiffness * (b.z - body.z) ** 2 for b in _bearings_of(case, shaft.name))
        # J ω² ∓ J_p Ω ω − k = 0: both roots lie J_p Ω/J apart
        split = body.polar_inertia * speed / sqrt(tilting * body.transverse_inertia)
        if split > NOTICED_SPLIT:
            yield (
                "gyroscopic",
                f"shaft {shaft.name} at {30 / pi * speed:.0f} rpm: its tilting frequency parts by {100 * split:.0f} %",
            )


def _span(bearings: list[Bearing]) -> float:
    """Return the distance (m) between the outermost of the bearings of a shaft."""
    places = [bearing.z for bearing in bearings]
    return max(places) - min(places)


def _bearings_of(case: GearboxCase, shaft: str) -> list[Bearing]:
    """Return the bearings on a shaft with constant stiffness, those to other shafts included."""
    links = [one for one in case.gearbox.shaft_bearings if shaft in (one.shaft, one.outer_shaft)]
    return [*(one for one in constant_bearings(case) if one.shaft == shaft), *links]
