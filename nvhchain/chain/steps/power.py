"""How much sound a moving surface radiates, how well it does so and where to."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

from nvhchain import acoustics
from nvhchain.case import Case, GearboxCase
from nvhchain.chain.steps.sound import ROUNDING, span
from nvhchain.fidelity import Fidelity
from nvhchain.files.shelf import Shelf
from nvhchain.handoff import (
    Directivity,
    FieldPressure,
    ForceSpectrum,
    RadiationEfficiency,
    RadiationResistance,
    ReducedHousing,
    SoundPower,
    Surface,
    SurfaceVelocity,
)


def sound_power(
    case: Case,
    velocity: SurfaceVelocity,
    forces: ForceSpectrum | None,
    fidelity: Fidelity,
    shelf: Shelf,
    executor: Executor | None,
) -> SoundPower:
    """Sound power of a surface velocity, solved at every line."""
    speed = forces.input_speed if forces is not None else 0.0
    where: dict[str, Any] = {"air": case.air, "engine": case.engine, "plane": case.reflecting_plane}
    return shelf.stage_in_parts(
        "sound_power",
        SoundPower,
        "acoustics",
        (velocity, where, speed),
        lambda progress, parts: acoustics.sound_power(
            velocity, **where, fidelity=fidelity.acoustics, executor=executor, progress=progress, shards=parts
        ).replace(input_speed=speed),
        fidelity=fidelity.acoustics,
    )


def radiation_resistance(
    case: GearboxCase,
    reduced: ReducedHousing,
    forces: ForceSpectrum,
    fidelity: Fidelity,
    shelf: Shelf,
    executor: Executor | None,
) -> RadiationResistance:
    """Radiation resistance of the housing in its modal coordinates over the band and the lines of the forces, with the
    residual motion of those bearings and axes only that carry any."""
    where: dict[str, Any] = {"air": case.air, "engine": case.engine, "plane": case.reflecting_plane}
    low, high = span(case, forces.frequency)
    loaded = acoustics.loaded_seats(reduced, forces)
    band = (low * (1 - ROUNDING), high * (1 + ROUNDING))
    return shelf.stage_in_parts(
        "radiation_resistance-{key}",
        RadiationResistance,
        "acoustics",
        (reduced, loaded, band, where),
        lambda progress, parts: acoustics.adaptive_radiation_resistance(
            acoustics.housing_shapes(reduced, loaded),
            *band,
            **where,
            fidelity=fidelity.acoustics,
            executor=executor,
            progress=progress,
            shards=parts,
        ),
        fidelity=fidelity.acoustics,
    )


def modal_power(
    resistance: RadiationResistance, reduced: ReducedHousing, forces: ForceSpectrum, fidelity: Fidelity, shelf: Shelf
) -> SoundPower:
    """Sound power of the housing under bearing forces."""
    return shelf.stage(
        "sound_power",
        SoundPower,
        "acoustics",
        (resistance, reduced, forces),
        lambda progress: acoustics.modal_power(resistance, reduced, forces, fidelity=fidelity.acoustics).replace(
            input_speed=forces.input_speed
        ),
        fidelity=fidelity.acoustics,
    )


def radiation_efficiency(case: Case, power: SoundPower, velocity: SurfaceVelocity, shelf: Shelf) -> RadiationEfficiency:
    """Radiation efficiency of a surface velocity."""
    return _efficiency(shelf, acoustics.surface_efficiency, power, velocity, case.air)


def modal_efficiency(
    power: SoundPower, resistance: RadiationResistance, reduced: ReducedHousing, forces: ForceSpectrum, shelf: Shelf
) -> RadiationEfficiency:
    """Radiation efficiency of the housing under bearing forces."""
    return _efficiency(shelf, acoustics.modal_efficiency, power, resistance, reduced, forces)


def _efficiency(shelf: Shelf, compute: Callable[..., RadiationEfficiency], *inputs: Any) -> RadiationEfficiency:
    return shelf.stage(
        "radiation_efficiency",
        RadiationEfficiency,
        "acoustics",
        inputs,
        lambda progress: compute(*inputs),
        fidelity=None,
    )


def directivity(case: Case, pressure: FieldPressure, power: SoundPower, surface: Surface, shelf: Shelf) -> Directivity:
    """Directivity at the field points."""
    return shelf.stage(
        "directivity",
        Directivity,
        "acoustics",
        (pressure, power, surface, case.air, case.reflecting_plane),
        lambda progress: acoustics.directivity(pressure, power, surface, case.air, plane=case.reflecting_plane),
        fidelity=None,
    )
