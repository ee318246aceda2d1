"""Sound power of a moving surface, its radiation efficiency and its directivity."""

from __future__ import annotations

from typing import Any

from nvhchain import acoustics
from nvhchain.acoustics import Adaptive, Work
from nvhchain.chain.running import Run
from nvhchain.chain.steps.sound import ROUNDING, band_of, exterior_problem, speed_of, surroundings
from nvhchain.handoff import Directivity, RadiationEfficiency, RadiationResistance, SoundPower
from nvhchain.scene.steps import (
    DIRECTIVITY,
    FORCE_SPECTRUM,
    HOUSING,
    PRESSURE,
    RADIATION_EFFICIENCY,
    RADIATION_RESISTANCE,
    SOUND_POWER,
    SURFACE_VELOCITY,
)


def radiation_resistance(run: Run) -> RadiationResistance:
    """Radiation resistance of the housing in its modal coordinates, over the band and the lines of the forces.

    Its residual shapes are those of loaded bearings and axes only.
    """
    where, reduced, forces = surroundings(run), run[HOUSING], run[FORCE_SPECTRUM]
    low, high = band_of(run.case, forces.frequency)
    loaded = acoustics.loaded_bearings(reduced, forces)
    band = (low * (1 - ROUNDING), high * (1 + ROUNDING))
    made: RadiationResistance = run.cached_in_parts(
        RADIATION_RESISTANCE,
        (reduced, loaded, band, where),
        lambda progress, parts: exterior_problem(run, reduced.surface).resistance(
            acoustics.housing_shapes(reduced, loaded), Adaptive(*band), Work(run.executor, progress, parts)
        ),
    )
    return made


def sound_power(run: Run) -> SoundPower:
    """Sound power of the housing under bearing forces, or of one surface velocity solved at every line."""
    speed, knobs = speed_of(run), run.fidelity.acoustics
    made: SoundPower
    if run.scene.power_uses_modes:
        inputs = run[RADIATION_RESISTANCE], run[HOUSING], run[FORCE_SPECTRUM]
        made = run.cached(
            SOUND_POWER,
            inputs,
            lambda progress: acoustics.modal_power(*inputs, fidelity=knobs).replace(input_speed=speed),
        )
        return made
    velocity, where = run[SURFACE_VELOCITY], surroundings(run)
    made = run.cached_in_parts(
        SOUND_POWER,
        (velocity, where, speed),
        lambda progress, parts: (
            exterior_problem(run, velocity.surface)
            .power(velocity, Work(run.executor, progress, parts))
            .replace(input_speed=speed)
        ),
    )
    return made


def radiation_efficiency(run: Run) -> RadiationEfficiency:
    """Radiation efficiency of the housing under bearing forces, or of one surface velocity."""
    made: RadiationEfficiency
    power = run[SOUND_POWER]
    if run.scene.power_uses_modes:
        modal = power, run[RADIATION_RESISTANCE], run[HOUSING], run[FORCE_SPECTRUM]
        made = run.cached(RADIATION_EFFICIENCY, modal, lambda progress: acoustics.modal_efficiency(*modal))
        return made
    inputs = power, run[SURFACE_VELOCITY], run.case.air
    made = run.cached(RADIATION_EFFICIENCY, inputs, lambda progress: acoustics.surface_efficiency(*inputs))
    return made


def directivity(run: Run) -> Directivity:
    """Directivity at the field points."""
    inputs: tuple[Any, ...] = (run[PRESSURE], run[SOUND_POWER], run[SURFACE_VELOCITY].surface, run.case.air)
    plane = run.case.reflecting_plane
    made: Directivity = run.cached(
        DIRECTIVITY, (*inputs, plane), lambda progress: acoustics.directivity(*inputs, plane=plane)
    )
    return made
