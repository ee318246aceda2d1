"""Housing of a run-up in three dimensions: its operating shape at the loudest orders over speed."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from nvhchain import levels
from nvhchain.acoustics import interpolate_vectors
from nvhchain.conventions import REFERENCE_VELOCITY
from nvhchain.errors import InputError, silence_accuracy_warnings
from nvhchain.handoff import BearingForces, ComplexArray, FloatArray, ReducedHousing, TransferVectors
from nvhchain.housing import respond
from nvhchain.report.causes.run_up import LEAST_RISE, order_forces
from nvhchain.report.page.moving import Colours, MovingBody, moving_bodies
from nvhchain.report.page.sections.bodies.housing import CONTRIBUTION, phase_pressure
from nvhchain.report.run_up import Curve
from nvhchain.report.stored import Stored

TITLE = "Housing over speed"

ORDERS, SPEEDS = 2, 24
"""Largest numbers of orders, and of speeds of each."""

SAME_PLACE = 1e-9
"""Largest distance (m) of field points at one place."""


def blocks(stored: Stored) -> list[Any]:
    """Return the bodies of all run-ups with a slider over orders and speeds."""
    found = [
        (run, forces, housing)
        for _, run, _ in stored.having(lambda run: run.pressure_history)
        if (forces := run.hand_off("bearing_forces", BearingForces)) and (housing := stored.housing(run))
    ]
    if not found:
        return []
    cuts = {run.name: stored.curves[run.name][1:] for run, *_ in found}
    places = _places(cuts, [forces for _, forces, _ in found], _highest(stored))
    if not places:
        return []
    bodies = []
    for run, forces, reduced in found:
        motion = _motion(forces, reduced, places)
        assert run.pressure_history is not None
        vectors, point = stored.radiating(TransferVectors, reduced.surface.content_hash), run.pressure_history.points[0]
        parts = _contribution(vectors, point, reduced, places, motion)
        bodies.append(MovingBody(run.name, reduced.surface, motion, {} if parts is None else {CONTRIBUTION: parts}))
    heard = np.array([[_level(run_cuts, *place) for place in places] for run_cuts in cuts.values()])
    texts = [_text(cuts, place, heard[:, number]) for number, place in enumerate(places)]
    weight = [float(levels.a_weighting(order * speed / (2 * np.pi))) for order, speed in places]
    caption = (
        "Operating shape of the housing in the run-up. The slider runs over the speeds of the loudest orders, with "
        "their levels, and starts at the loudest in dB(A). Drag to turn; scroll to zoom after a click."
    )
    colours = [Colours("Normal velocity", "dB re 1 nm/s", "level", REFERENCE_VELOCITY)]
    if all(CONTRIBUTION in body.values for body in bodies):
        colours.append(Colours(CONTRIBUTION, "mPa/dm²", "signed"))
        caption += (
            f" Contributions are pressure at {stored.runs[0].point_name(0)} in phase with the sum, per area of the "
            "face, as in a steady state at that speed; red adds, blue cancels."
        )
    return [
        moving_bodies(bodies, texts, colours, caption, chosen=int((heard.max(axis=0) + weight).argmax()), what="speed")
    ]


def _highest(stored: Stored) -> float:
    """Return the highest frequency (Hz) of the maps."""
    return min(float(waterfall.axis[-1]) for waterfall, _ in stored.run_up_maps.values())


def _places(cuts: dict[str, list[Curve]], forces: list[BearingForces], highest: float) -> list[tuple[float, float]]:
    """Return order and speed (rad/s) of every place of the slider."""
    slow = max(float(record.input_speed.min()) for record in forces)
    fast = min(float(record.input_speed.max()) for record in forces)
    if fast < LEAST_RISE * slow:  # a record of a fluctuating speed, not a run-up
        return []
    speeds = np.linspace(max(slow, 0.05 * fast), fast, SPEEDS + 2)[1:-1]
    first = next(iter(cuts.values()))
    loud = {
        cut.order: max(
            float(np.max(each[number].level + levels.a_weighting(cut.order * each[number].speed / (2 * np.pi))))
            for each in cuts.values()
        )
        for number, cut in enumerate(first)
        if cut.order
    }
    chosen = sorted(sorted(loud, key=lambda order: -loud[order])[:ORDERS])
    return [(order, float(n)) for order in chosen for n in speeds if order * n / (2 * np.pi) <= highest]


def _motion(forces: BearingForces, housing: ReducedHousing, places: list[tuple[float, float]]) -> ComplexArray:
    """Return the normal velocity (n_place, n_face) m/s."""
    rows = []
    for order in dict.fromkeys(order for order, _ in places):
        speeds = np.array([speed for other, speed in places if other == order])
        rows.append(respond(housing, order_forces(forces, order, speeds)).normal_velocity)
    return np.concatenate(rows)


def _contribution(
    vectors: list[TransferVectors],
    point: FloatArray,
    housing: ReducedHousing,
    places: list[tuple[float, float]],
    motion: ComplexArray,
) -> FloatArray | None:
    """Return the contribution of every face to the sound at a point (3,) m, (n_place, n_face) in mPa/dm².

    None without vectors to this point at all frequencies.
    """
    frequency = np.array([order * speed / (2 * np.pi) for order, speed in places])
    lines, back = np.unique(frequency, return_inverse=True)
    for transfer_vectors in vectors:
        apart = np.linalg.norm(transfer_vectors.points - point, axis=1)
        if apart.min() > SAME_PLACE:
            continue
        with suppress(InputError), silence_accuracy_warnings():
            line_vectors = interpolate_vectors(transfer_vectors, lines).vectors[back, apart.argmin()]
            return phase_pressure(line_vectors * motion, housing.surface.areas)
    return None


def _level(cuts: list[Curve], order: float, speed: float) -> float:
    """Return the level (dB) of an order at a speed."""
    order_cut = next(cut for cut in cuts if cut.order == order)
    rising = np.argsort(order_cut.speed)
    return float(np.interp(speed, order_cut.speed[rising], order_cut.level[rising]))


def _text(cuts: dict[str, list[Curve]], place: tuple[float, float], heard: FloatArray) -> str:
    order, speed = place
    name = next(cut.name for cut in next(iter(cuts.values())) if cut.order == order)
    sound = ", ".join(f"{run} {levels.number_text(level)} dB" for run, level in zip(cuts, heard, strict=True))
    return f"{name}, {30 * speed / np.pi:.0f} rpm ({order * speed / (2 * np.pi):.0f} Hz): {sound}"
