"""Every knob turned on a case small enough to be measured again: the single stage of `small_gearbox`, and spheres.

Measure claims.json again: `python -m tests.tradeoff.turned_knobs OUT`; state in the commit why it changed.

What a knob leaves alone is made once. Of the acoustics one line of the housing's motion is radiated; what goes on
between lines is seen on spheres.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest.mock import patch

import numpy as np

import nvhchain as nvh
from nvhchain.case import FieldPoint, RadiatorCase, Ramp, Sphere
from nvhchain.chain.result import Result
from nvhchain.fidelity import Fidelity, HousingFidelity
from nvhchain.housing import reduction
from nvhchain.testing.coarse_runs import TINY, small_gearbox
from nvhchain.tradeoff import (
    SWEPT_KNOBS,
    Deviation,
    Measurement,
    Tradeoff,
    as_json,
    deviation,
    deviation_in_time,
    variants,
)

EVERY_VALUE = ("dynamics", "acoustics.radiation")
"""Stage and knob whose values cost next to nothing; of others the first that differs from the base is tried."""

BETWEEN_LINES = [f"acoustics.{name}" for name in ("master_tolerance_db", "interpolation_points", "interpolation_poles")]
OF_FACES = ["acoustics.elements_per_wavelength"]
RUN_UP = [knob.name for knob in SWEPT_KNOBS if knob.run_up]
STRIKING = "dynamics.path_correction"


def measured(folder: Path) -> dict[tuple[str, str], Deviation]:
    """(knob, value) → error against `TINY`.  folder: of operators."""
    case = small_gearbox()
    orders = [float(order) for order in case.mesh_orders.values()]
    found: dict[tuple[str, str], Deviation] = {}
    with shared_meshes():
        base = nvh.run(case, fidelity=TINY, operators=folder)
        for knob, value, fidelity in tried(case, TINY, ["gear", "dynamics", "housing"]):
            yardstick = base
            if knob == STRIKING:  # its step is shorter
                fidelity, plain = (stepping(of, 30e-6) for of in (fidelity, TINY))
                yardstick = nvh.run(case, fidelity=plain, operators=folder)
            turned = nvh.run(case, fidelity=fidelity, operators=folder)
            found[knob, value] = deviation(turned.pressure, yardstick.pressure, orders)
    return found | of_run_up(base) | of_one_line(base) | of_spheres()


def of_run_up(base: Result) -> dict[tuple[str, str], Deviation]:
    """Of the record of a run-up from 1800 to 2100 rpm in half a second."""
    rising = replace(base.case, operation=replace(base.case.operation, ramp=Ramp(220.0, 0.5)))

    def heard(fidelity: Fidelity):
        made = {"mesh_laws": base.mesh_laws, "housing": base.housing, "transfer_vectors": base.transfer_vectors}
        return nvh.run(rising, fidelity=fidelity, **made).pressure_history

    yardstick = heard(TINY)
    return {
        (knob, value): deviation_in_time(heard(fidelity), yardstick)
        for knob, value, fidelity in tried(rising, TINY, RUN_UP)
    }


def of_one_line(base: Result) -> dict[tuple[str, str], Deviation]:
    """Of what the housing's motion at the fourth mesh harmonic radiates."""
    velocity = base.surface_velocity
    line = [int(np.argmin(np.abs(velocity.frequency - 2400.0)))]
    moving = velocity.replace(frequency=velocity.frequency[line], normal_velocity=velocity.normal_velocity[line])

    def heard(fidelity: Fidelity):
        return nvh.run(base.case, fidelity=fidelity, surface_velocity=moving).pressure

    yardstick, others = heard(TINY), [*BETWEEN_LINES, *OF_FACES]
    return {
        (knob, value): deviation(heard(fidelity), yardstick)
        for knob, value, fidelity in tried(base.case, TINY, ["acoustics"])
        if not knob.startswith(tuple(others))
    }


def of_spheres() -> dict[tuple[str, str], Deviation]:
    """An oscillating sphere at more lines than are solved one by one, and up to where 320 and 1280 faces are taken."""
    points = (FieldPoint("front", (0.0, 0.1, 0.9)), FieldPoint("side", (0.6, 0.0, 0.2)))
    many = tuple(200.0 + 100.0 * n for n in range(18))
    asked = {many: BETWEEN_LINES, (500.0, 4500.0): OF_FACES}
    found: dict[tuple[str, str], Deviation] = {}
    for lines, names in asked.items():
        sphere = RadiatorCase("sphere", Sphere(0.1), lines, points, pulsation=0.3, velocity=(0.0, 0.0, 1.0))
        yardstick = nvh.run(sphere, fidelity=TINY).pressure
        for knob, value, fidelity in tried(sphere, TINY, names):
            found[knob, value] = deviation(nvh.run(sphere, fidelity=fidelity).pressure, yardstick)
    return found


def tried(case, base: Fidelity, names: list[str]) -> Iterator[tuple[str, str, Fidelity]]:
    """Variants of the knobs of these names, every value of those that cost little, one of the others."""
    seen = set()
    for knob, value, fidelity in variants(case, base, names):
        if knob not in seen or knob.startswith(EVERY_VALUE):
            seen.add(knob)
            yield knob, value, fidelity


def stepping(fidelity: Fidelity, step: float) -> Fidelity:
    """The fidelity with this time step, s."""
    return replace(fidelity, dynamics=replace(fidelity.dynamics, time_step=step))


@contextmanager
def shared_meshes() -> Iterator[None]:
    """Within it the casting is meshed once for all knobs that leave its mesh and its faces alone."""
    make, envelope = reduction.mesh_casting, cache(reduction.radiating_surface)

    @cache
    def of_size(casting, element_size, elements_per_turn):
        return make(casting, HousingFidelity(element_size, elements_per_turn=elements_per_turn))

    def mesh(casting, fidelity):
        return of_size(casting, fidelity.element_size, fidelity.elements_per_turn)

    with patch.multiple(reduction, mesh_casting=mesh, radiating_surface=envelope):
        yield


if __name__ == "__main__":
    rows = [Measurement("base", "tiny", {}, None)]
    rows += [Measurement(knob, value, {}, error) for (knob, value), error in measured(Path(sys.argv[1])).items()]
    claims = Tradeoff("single-stage", "tiny", tuple(rows))  # times are no claims
    Path(__file__).with_name("claims.json").write_text(as_json(claims), encoding="utf-8")
