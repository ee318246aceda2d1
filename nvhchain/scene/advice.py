"""Options that the dynamics of a case would notice, each with what makes it matter here and what it did where it was
measured: said by `plan` and `check`, never switched on by itself."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt

import numpy as np

from nvhchain import gear
from nvhchain.case import GearboxCase
from nvhchain.dynamics import Bearing, Shaft
from nvhchain.dynamics.model.shaft_beam import elastic_shaft
from nvhchain.errors import InputError

MEASURED = {"friction": 13.1, "shuttling": 15.7, "flexible_shafts": -27.3, "gyroscopic": -0.003}
"""dB, what each did to the worst mesh harmonic of the bearing forces of the example gearbox at 2500 rpm
(docs/measured/dynamics/options.md)."""
NOTICED_SWING = 1e-3
"""Of the distance of a shaft's bearings, by which a mesh's load moves along the face: 0.05 % of its force then
alternates at each bearing, some 30 dB below what a mesh stiffness that swings by 2 % makes."""
NOTICED_SPLIT = 0.1
"""Of a tilting frequency, by which gyroscopic terms part it: the width of a resonance damped by 5 %, as bearings damp
tilting; 5 %, the example at 20 000 rpm, is no more than a few hundredths of a decibel (benchmarks/dynamics/options.py,
`speeds`)."""
NOTICED_GIVE = 0.1
"""Of what a gear gives way on its bearings: 5 % of a natural frequency."""
ANGLES, SLICES = 24, 32
"""Of a mesh period and of the face, at which the contact lines are looked at."""
ELEMENT = 1.0
"""m, of a beam whose static deflection at its nodes is exact whatever their distance."""


def advice(case: GearboxCase) -> tuple[str, ...]:
    """One sentence per option that is not on and that this gearbox would notice."""
    options = case.options
    considered = (
        (options.friction > 0.0, _friction),
        (options.shuttling, _shuttling),
        (options.flexible_shafts, _flexible),
        (options.gyroscopic, _gyroscopic),
    )
    return tuple(
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
        span = min(_span(case.bearings, gears[name]) for name in (stage.pinion, stage.wheel))
        if swing > NOTICED_SWING * span:
            yield (
                "shuttling",
                f"stage {stage.name}: helical, its load moves by {1e3 * swing:.2g} mm along the face, "
                f"{100 * swing / span:.1f} % of the distance of the bearings",
            )


def load_swing(pair: gear.GearPair) -> float:
    """m by which the middle of all contact lines moves along the face in a mesh period: of a load spread evenly."""
    middle = []
    for angle in np.arange(ANGLES) * pair.mesh_period / ANGLES:
        lines = gear.contact_lines(pair, float(angle), slices=SLICES)
        middle.append(float(lines.length @ lines.axial) / float(lines.length.sum()))
    return float(np.ptp(middle))


def _flexible(case: GearboxCase) -> Iterator[tuple[str, str]]:
    for shaft in case.shafts:
        places = [item.z for item in case.gears if item.shaft == shaft.name]
        bearings = [bearing for bearing in case.bearings if bearing.shaft == shaft.name]
        give = max((bending_share(shaft, bearings, z) for z in places), default=0.0)
        if give > NOTICED_GIVE:
            yield (
                "flexible_shafts",
                f"shaft {shaft.name} bends under its gears by {100 * give:.0f} % of what its bearings give way",
            )


def bending_share(shaft: Shaft, bearings: list[Bearing], z: float) -> float:
    """How much more a shaft gives way at z, m, under a radial force there than a rigid one on the same bearings.

    0 for a shaft whose segments do not reach so far, which cannot be taken as flexible.
    """
    push = np.eye(6)[0]
    try:
        elastic = elastic_shaft(shaft, [(z, push), *((b.z, push) for b in bearings)], element=ELEMENT, frequency=0.0)
    except InputError:
        return 0.0

    def at(place: float) -> np.ndarray:
        return np.concatenate([[1.0, place], elastic.at(place)[0]])

    stiffness = np.diag(np.concatenate([np.zeros(2), elastic.squared]))
    for bearing in bearings:
        stiffness += bearing.radial_stiffness * np.outer(at(bearing.z), at(bearing.z))
    rigid = at(z)[:2] @ np.linalg.solve(stiffness[:2, :2], at(z)[:2])
    return float(at(z) @ np.linalg.solve(stiffness, at(z)) / rigid - 1.0)


def _gyroscopic(case: GearboxCase) -> Iterator[tuple[str, str]]:
    ramp = case.operation.ramp
    fastest = max(case.operation.input_speed, ramp.end_speed if ramp else 0.0)
    for shaft in case.gearbox_with_gears.shafts:
        body, speed = shaft.inertia(), fastest * float(case.shaft_orders.get(shaft.name, 0))
        tilting = sum(b.radial_stiffness * (b.z - body.z) ** 2 for b in case.bearings if b.shaft == shaft.name)
        # J ω² ∓ J_p Ω ω − k = 0: both roots lie J_p Ω/J apart
        split = body.polar_inertia * speed / sqrt(tilting * body.transverse_inertia)
        if split > NOTICED_SPLIT:
            yield (
                "gyroscopic",
                f"shaft {shaft.name} at {30 / pi * speed:.0f} rpm: its tilting frequency parts by {100 * split:.0f} %",
            )


def _span(bearings: tuple[Bearing, ...], shaft: str) -> float:
    """m between the outermost bearings of a shaft."""
    places = [bearing.z for bearing in bearings if bearing.shaft == shaft]
    return max(places) - min(places)
