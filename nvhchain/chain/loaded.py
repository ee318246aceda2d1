"""Gears under load: static misalignment, and flank compliances that several steps need."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from nvhchain import dynamics, gear
from nvhchain.case import GearboxCase
from nvhchain.conventions import Progress
from nvhchain.fidelity import Fidelity, GearFidelity
from nvhchain.files.result_cache import ResultCache, fingerprint
from nvhchain.handoff import BodyModes, FlankFlexibility, FloatArray, MeshPeriod, ReducedHousing
from nvhchain.scene.body_modes import vibrating_bodies
from nvhchain.scene.loaded_tilt import ANGLES, SLICES, balanced_tilts, tilted
from nvhchain.scene.steps import MESH_LAWS

ANGLE_DIGITS = 9
"""Decimal digits of tilts in rad: 1 nrad, 0.04 nm at the ends of a face.

Differences from rounding then give the same gear pair, and so the same cached results.
"""

Compliances = Callable[[Progress], tuple[Any, Any]]
"""Function that returns the flank compliances of a pair, computed at the first call."""


def compliances(case: GearboxCase, fidelity: Fidelity, shared: ResultCache) -> tuple[Compliances, ...]:
    """Flank compliances of every stage, for several steps; those of every gear body are kept in `shared`."""
    flanks = partial(_kept_flanks, shared.unwatched)
    return tuple(_lazily(pair, fidelity, flanks) for pair in case.pairs)


def gear_bodies(case: GearboxCase, fidelity: GearFidelity, shared: ResultCache) -> tuple[dynamics.VibratingBody, ...]:
    """Return the gears whose bodies vibrate in the band; the modes of every body are kept in `shared`."""
    cache = shared.unwatched

    def modes(body: gear.GearBody, highest: float) -> BodyModes:
        made: BodyModes = cache.cached(
            "body_modes-{key}",
            BodyModes,
            MESH_LAWS.code,
            (body, highest),
            lambda _: gear.body_modes(body, highest),
            fidelity=None,
        )
        return made

    return tuple(replace(body, held_by_law=fidelity.bodies != "analytic") for body in vibrating_bodies(case, modes))


def _kept_flanks(
    cache: ResultCache, body: gear.GearBody, knobs: GearFidelity, *, reach: int, progress: Progress
) -> gear.FlankCompliance:
    """Return the compliance of a gear from the cache, or compute and keep it; imported meshes are not kept."""
    if isinstance(body.blank, gear.VolumeMesh):
        return gear.flank_compliance(body, knobs, reach=reach, progress=progress)
    plain = replace(body, geometry=replace(body.geometry, micro=gear.MicroGeometry()))  # no part of the mesh
    found = cache.cached(
        "flank_flexibility-{key}",
        FlankFlexibility,
        MESH_LAWS.code,
        (plain, reach),
        lambda _: gear.flank_flexibility(plain, knobs, reach=reach, progress=progress),
        fidelity=knobs,
    )
    return gear.compliance_at_points(found)


def _lazily(pair: gear.GearPair, fidelity: Fidelity, flanks: Callable[..., gear.FlankCompliance]) -> Compliances:
    computed: list[tuple[Any, Any]] = []

    def once(progress: Progress) -> tuple[Any, Any]:
        if not computed:
            computed.append(gear.pair_compliances(pair, fidelity.gear, progress=progress, flanks=flanks))
        return computed[0]

    return once


def balanced(
    case: GearboxCase, housing: ReducedHousing | None, fidelity: Fidelity, face_moment: FloatArray | None = None
) -> dynamics.Equilibrium:
    """Return the static equilibrium of a case on its housing (None for rigid seats).

    face_moment: (n_mesh,) moment (N m) of the load about mid-width.
    """
    return dynamics.equilibrium(
        case.gearbox_with_gears,
        case.straight_laws,
        housing,
        input_torque=case.static_torque,
        fidelity=fidelity.dynamics,
        face_moment=face_moment,
    )


def opposing_forces(case: GearboxCase) -> list[float]:
    """Return the static force (n_mesh,) (N) of every mesh, whose moment opposes the tilt of its gears."""
    loaded = case.static_torque if case.load_dependent else case.operation.input_torque
    each = zip(case.stages, case.mesh_forces, strict=True)
    return [force if loaded and not case.idles(stage) else 0.0 for stage, force in each]


def loaded_case(
    case: GearboxCase, housing: ReducedHousing | None, fidelity: Fidelity, flanks: Sequence[Compliances]
) -> GearboxCase:
    """Return the case with its stages misaligned by the tilt of the gears under load.

    The tilt is that of shafts, bearings and housing (None for rigid seats) under the nominal mesh forces. The teeth
    oppose it with the moment of the load about mid-width (`balanced_tilts`). The latest cases are kept: a comparison
    asks for each of them several times.
    """
    key = fingerprint(case, fidelity, None if housing is None else housing.content_hash)
    found = _LOADED.get(key)
    if found is None:
        found = _loaded(case, housing, fidelity, flanks)
        if len(_LOADED) >= _KEPT:
            _LOADED.clear()
        _LOADED[key] = found
    return found


_KEPT = 16
_LOADED: dict[str, GearboxCase] = {}
"""Fingerprint of case, fidelity and housing → the case under load."""


def _loaded(
    case: GearboxCase, housing: ReducedHousing | None, fidelity: Fidelity, flanks: Sequence[Compliances]
) -> GearboxCase:
    tilts = _tilts(case, housing, fidelity)
    forces = opposing_forces(case)
    knobs = replace(fidelity.gear, angles_per_mesh=ANGLES, slices=min(SLICES, fidelity.gear.slices))

    def loaded(number: int, pair: gear.GearPair) -> MeshPeriod:
        compliances = flanks[number](lambda done, total: None)
        return gear.mesh_period(pair, nominal_force=forces[number], fidelity=knobs, compliances=compliances)

    found = balanced_tilts(case.pairs, forces, tilts, loaded)
    stages = tuple(
        replace(stage, misalignment=tilted(pair, np.round(tilt, ANGLE_DIGITS)).misalignment)
        for stage, pair, tilt in zip(case.stages, case.pairs, found, strict=True)
    )
    return replace(case, stages=stages)


def _tilts(case: GearboxCase, housing: ReducedHousing | None, fidelity: Fidelity) -> Callable[[FloatArray], FloatArray]:
    """Return the function from moments of the teeth to the tilts that they oppose."""
    if case.load_dependent:
        return lambda moment: balanced(case, housing, fidelity, moment).misalignment
    return dynamics.opposed_misalignment(
        replace(case.gearbox_with_gears, face_points=1),
        case.straight_laws,
        housing,
        input_torque=case.operation.input_torque,
        fidelity=fidelity.dynamics,
    )
