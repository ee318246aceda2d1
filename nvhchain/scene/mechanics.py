"""Costs of mesh laws, the housing and the time integration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import ceil, gcd, inf, lcm, pi

import numpy as np

from nvhchain import gear
from nvhchain.case import Extent, GearboxCase, Stage
from nvhchain.dynamics.runs.decimation import record_stride
from nvhchain.dynamics.runs.steady import settling_time
from nvhchain.dynamics.time_loop.simulation import simulation
from nvhchain.fidelity import Fidelity, GearFidelity
from nvhchain.gear import GearBody, GearPair, VolumeMesh
from nvhchain.scene.body_modes import vibrating_bodies
from nvhchain.scene.planned import BASE_MEGABYTES, SECONDS_PER_STEP, PlannedStep
from nvhchain.scene.steps import BEARING_FORCES, HOUSING, LOAD_DISTRIBUTIONS, MESH_LAWS

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/chain/plan.md and
# docs/measured/chain/plan_knobs.md by benchmarks/chain/plan.py; of gears 0.65 of these seconds, by the shipped sweep.
# Teeth: 0.85 s with 12 layers and 4 elements of the profile, 2.6 s with 24 and 4, 2.6 s with 12 and 10, on one core.
_SECONDS_PER_TOOTH = 1.05e-3
_SECONDS_PER_LOADED_TOOTH, _LOADED_GROWTH = 3.8e-6, 0.5
_SECONDS_PER_TOOTH_LAYERS = 3.9e-3
_LAYER_GROWTH = 1.5
_PROFILE_GROWTH = 1.2
_MESH_GROWTH = 0.43
_REFINED = 1.8
_WEB_GROWTH = 0.9
_SECONDS_PER_LINES = 1.0e-3
_SECONDS_PER_COUPLING = 3.4e-8
_SECONDS_PER_ELIMINATION = 7e-11
_SLICES_IN_CACHE = 300
# mesh laws and load distributions of ten pairs with 1 to 41 meshes and 32 to 93 slices, laws of up to 700 slices
_SECONDS_PER_PHASE, _SECONDS_PER_CONTACT, _SEARCHED = 2.0e-3, 2.9e-8, 100
_SECONDS_PER_DISTRIBUTION_PHASE, _SECONDS_PER_DISTRIBUTION, _SECONDS_PER_DISTRIBUTED = 1.7e-3, 3.5e-4, 3.0e-7
_LINES_PER_CONTACT_STEP = 5.5
_MEGABYTES_PER_TOOTH, _MEGABYTES_PER_ALIKE_TOOTH, _MEGABYTES_PER_TOOTH_LAYER = 0.37, 0.0164, 1.4
_MEMORY_GROWTH = 0.15
_REFINED_MEMORY = 1.5
_WEB_MEMORY_GROWTH = 0.7
_MEGABYTES_PER_UNKNOWN = 11e-3
_SECONDS_PER_STEP_AND_MODE = 7e-9
_ELASTIC_MOTIONS = 17
_SHARE_PER_ROW = 1.1
# motions of a flexible shaft, time of one more contact row per mesh: docs/measured/dynamics/options.md
_SECONDS_PER_BODY = 4.0
_SETTLING_PERIODS = 4
_MEGABYTES_PER_STEP_AND_OUTPUT = 48e-6
_MEGABYTES_PER_SAMPLE_AND_OUTPUT = 15e-6
_SECONDS_PER_SAMPLE_AND_OUTPUT = 4.5e-8
_SECONDS_PER_UNKNOWN = 1.69e-4
_SECONDS_PER_UNKNOWN_AND_MODE = 4e-7
_SECONDS_PER_SAMPLE = 8.9e-6
_MEGABYTES_PER_THOUSAND_UNKNOWNS = 1.75
_FILL_EXPONENT = 1.35
_SECONDS_TO_IMPORT_MODES = 10.0
# tooth pairs of a stage with deviations, which all draws share, and the law of each draw: processor seconds of the
# single stage in class 6 with 8 to 128 slices, 64 and 96 angles, 16 to 64 deflections and 60 to 609 meshes
_SECONDS_PER_PAIRS_ANGLE, _SECONDS_PER_PAIRS_COUPLING = 2.1e-3, 2.3e-6
_SECONDS_PER_DEVIATED_ANGLE, _SECONDS_PER_DEVIATED_COUPLING = 2.2e-3, 4.7e-6
_SECONDS_PER_DEVIATED_SLICE, _SECONDS_PER_DEVIATED = 4.5e-7, 6.5e-7
_COPIES = 14
_DISTRIBUTION_RATIO = 1.9
"""Seconds of the law of a draw with its load distribution, over those of the law."""
_MOST_ANGLES, _USUAL_SLICES = 512, 32
"""Largest number of angles of a mesh law to which slow speeds refine it, and of its slices at that number.

Gears with openings have more. Four times as many narrow the limits at 500 rpm from 13.2 to 12.6 dB, for 3 s: layers of
the teeth decide there.
"""


def law_knobs(case: GearboxCase, number: int, knobs: GearFidelity) -> GearFidelity:
    """Return the knobs of a mesh law, with more angles where the band has more mesh harmonics than a third of them.

    number: number of the stage.
    knobs: those of the fidelity.

    A law holds half as many harmonics as angles, the last ones with large errors. The angles are doubled, so that few
    speeds have laws of their own. A run-up counts with its mean speed, as its slow beginning is quiet. Laws with
    manufacturing deviations keep their angles, and those that would take long: of more than `_MOST_ANGLES`, of less
    with many slices.
    """
    speed = sum(case.speeds) / (2.0 * 2.0 * pi)
    harmonics = int(case.band.high / (float(case.mesh_orders[case.stages[number].name]) * speed))
    meshes = case.pairs[number].meshes_per_body_period if case.deviations[number] is None else inf
    meshes *= max(1.0, gear.slice_count(case.pairs[number], knobs) / _USUAL_SLICES) ** 2
    angles = knobs.angles_per_mesh
    while 3 * harmonics > angles and 2 * angles * meshes <= _MOST_ANGLES:
        angles *= 2
    return replace(knobs, angles_per_mesh=angles)


def mesh_law_steps(case: GearboxCase, fidelity: Fidelity) -> list[PlannedStep]:
    """Cost of the mesh law of every stage of the gearbox."""
    planned = []
    for number, (stage, pair, deviations) in enumerate(zip(case.stages, case.pairs, case.deviations, strict=True)):
        knobs = law_knobs(case, number, fidelity.gear)
        bodies = (pair.pinion, pair.wheel)
        meshes, slices = lcm(*(body.sector for body in bodies)), gear.slice_count(pair, knobs)
        seconds = _body_seconds(bodies, knobs) + _law_seconds(pair, knobs)
        if deviations is not None:
            angles = pair.meshes_per_body_period * knobs.angles_per_mesh
            seconds += angles * (_SECONDS_PER_PAIRS_ANGLE + _SECONDS_PER_PAIRS_COUPLING * slices**2)
        described = " and ".join(
            f"{body.geometry.teeth} teeth {type(body.blank).__name__.lower()} ({body.sector} by symmetry)"
            for body in bodies
        )
        planned.append(
            PlannedStep(
                MESH_LAWS,
                f"mesh law {stage.name}",
                f"{described}; {meshes * knobs.angles_per_mesh} angles × {knobs.deflections} deflections, "
                f"{slices} slices",
                seconds,
                BASE_MEGABYTES + max(_gear_megabytes(body, knobs) for body in bodies),
                {"teeth": sum(body.sector for body in bodies)},
                MESH_LAWS.file_of(stage.name),
            )
        )
        planned += _deviated_law(case, stage, knobs)
    return planned


def _deviated_law(case: GearboxCase, stage: Stage, knobs: GearFidelity) -> list[PlannedStep]:
    """Cost of the mesh law of a stage with manufacturing deviations, over whole turns of both gears."""
    number = case.stages.index(stage)
    pair, deviations = case.pairs[number], case.deviations[number]
    if deviations is None:
        return []
    meshes, slices = deviations.meshes(pair), gear.slice_count(pair, knobs)
    rows, size = meshes * knobs.angles_per_mesh, 2 * knobs.deflections
    angles = pair.meshes_per_body_period * knobs.angles_per_mesh
    words = f"{meshes} meshes until the same teeth meet again"
    seconds = angles * (_SECONDS_PER_DEVIATED_ANGLE + _SECONDS_PER_DEVIATED_COUPLING * slices**2)
    seconds += rows * (_SECONDS_PER_DEVIATED_SLICE * slices + _SECONDS_PER_DEVIATED * size)
    seconds *= _DISTRIBUTION_RATIO if case.options.load_distribution else 1.0
    megabytes = BASE_MEGABYTES + 1e-6 * 8 * rows * (_COPIES * size + 32 * slices)
    result = f"deviated_{MESH_LAWS.file_of(stage.name)}"
    return [PlannedStep(MESH_LAWS, f"deviated law {stage.name}", words, seconds, megabytes, result=result)]


def load_distribution_steps(case: GearboxCase, fidelity: Fidelity, *, includes_compliance: bool) -> list[PlannedStep]:
    """Cost of the load distribution of every stage, for friction, shuttling and tilt.

    If `includes_compliance`, the mesh laws are not computed; else the gears' finite elements are shared with the mesh
    laws.
    """
    planned = []
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        bodies = (pair.pinion, pair.wheel)
        angles = lcm(*(body.sector for body in bodies)) * fidelity.gear.angles_per_mesh
        models = f"{angles} angles under the nominal force"
        seconds, megabytes = _distribution_seconds(pair, fidelity.gear), BASE_MEGABYTES
        if includes_compliance:
            seconds += _body_seconds(bodies, fidelity.gear)
            megabytes += max(_gear_megabytes(body, fidelity.gear) for body in bodies)
        name, result = f"load distribution {stage.name}", LOAD_DISTRIBUTIONS.file_of(stage.name)
        planned.append(PlannedStep(LOAD_DISTRIBUTIONS, name, models, seconds, megabytes, result=result))
    return planned


def kept_modes(case: GearboxCase, fidelity: Fidelity) -> str:
    """Return words for the kept modes of the housing."""
    return f"modes to {fidelity.housing.mode_ratio * case.band.high:g} Hz"


def housing_step(case: GearboxCase, fidelity: Fidelity, extent: Extent) -> PlannedStep:
    """Cost of the reduction of the housing."""
    unknowns, modes = extent.unknowns, case.housing.modes_in_reach(case, fidelity.housing)
    if unknowns == 0:
        found = {"modes": modes}
        return PlannedStep(HOUSING, "housing", extent.models, _SECONDS_TO_IMPORT_MODES, BASE_MEGABYTES, found)
    return PlannedStep(
        HOUSING,
        "housing",
        f"about {unknowns / 1e3:.0f} k unknowns of {extent.models}; {kept_modes(case, fidelity)}, "
        f"Ritz vectors of {len(case.bearings)} seats",
        unknowns * (_SECONDS_PER_UNKNOWN + _SECONDS_PER_UNKNOWN_AND_MODE * modes)
        + _SECONDS_PER_SAMPLE * extent.triangles * fidelity.housing.samples_per_face**2,
        BASE_MEGABYTES + _MEGABYTES_PER_THOUSAND_UNKNOWNS * (1e-3 * unknowns) ** _FILL_EXPONENT,
        {"unknowns": unknowns, "modes": modes},
    )


def _law_seconds(pair: GearPair, knobs: GearFidelity) -> float:
    """Time (s) of the contact problems of a mesh law, whose largest deflection is sought on all phases and meshes.

    Contact lines are made once for each phase of a mesh and flank.
    """
    meshes, slices, phases = (
        lcm(pair.pinion.sector, pair.wheel.sector),
        _engaged_slices(pair, knobs),
        knobs.angles_per_mesh,
    )
    cases = meshes * phases * knobs.deflections + meshes + _SEARCHED
    eliminated = 2 * (phases * (meshes + 1) + meshes) * _elimination_seconds(gear.slice_count(pair, knobs))
    return 2 * phases * _SECONDS_PER_PHASE + _SECONDS_PER_CONTACT * cases * slices**2 + eliminated


def _distribution_seconds(pair: GearPair, knobs: GearFidelity) -> float:
    """Time (s) of a load distribution over the body period."""
    meshes, slices = lcm(pair.pinion.sector, pair.wheel.sector), _engaged_slices(pair, knobs)
    each = _SECONDS_PER_DISTRIBUTION + _SECONDS_PER_DISTRIBUTED * slices**2
    return knobs.angles_per_mesh * (_SECONDS_PER_DISTRIBUTION_PHASE + meshes * each)


def _engaged_slices(pair: GearPair, knobs: GearFidelity) -> float:
    """Return the mean number of slices that are in contact at once."""
    return gear.slice_count(pair, knobs) * pair.transverse_contact_ratio


def _lines_seconds(slices: int) -> float:
    """Return the time (s) of one set of contact lines, about three at once, with the coupling of all slices.

    Elimination grows with the cube of the slices beyond those whose matrices fit into the cache.
    """
    size = 3 * slices
    return _SECONDS_PER_LINES + _SECONDS_PER_COUPLING * size**2 + _elimination_seconds(slices)


def _elimination_seconds(slices: int) -> float:
    """Return the time (s) by which elimination exceeds its usual one where matrices do not fit into the cache."""
    return _SECONDS_PER_ELIMINATION * (3 * max(slices - _SLICES_IN_CACHE, 0)) ** 3


def _body_seconds(bodies: Sequence[GearBody], knobs: GearFidelity) -> float:
    """Time (s) of the finite elements of a pair of gears, whose teeth are condensed onto shared nodes, all coupled.

    The number of shared nodes grows with the layers of the blank, the size of their stiffness with its square. The
    teeth have layers of their own. A finer transverse mesh costs less for that stiffness than for the bricks of the
    blank, which are factored. Twice the refinement costs 2.1 times against 3.3 times.
    """
    if knobs.bodies != "elements":
        return 0.0
    coupled = [
        body.geometry.teeth * _blank_layers(body, knobs) ** 2 * gear.bricks_over_even(body, knobs) ** _WEB_GROWTH
        for body in bodies
    ]
    growth = 1.0 + _LOADED_GROWTH
    loaded = sum((body.sector - 1) * each**growth for body, each in zip(bodies, coupled, strict=True))
    finer = knobs.transverse_refinement**_REFINED * (knobs.profile_elements / knobs.row_aspect) ** _MESH_GROWTH
    drawn = [body for body in bodies if not isinstance(body.blank, VolumeMesh)]
    layers = [knobs.tooth_layers(body.geometry.relative_width) for body in drawn]
    profile = (knobs.transverse_refinement * knobs.profile_elements) ** _PROFILE_GROWTH
    teeth = profile * sum(count**_LAYER_GROWTH for count in layers)
    seconds = finer * (_SECONDS_PER_TOOTH * sum(coupled) + _SECONDS_PER_LOADED_TOOTH * loaded)
    return float(seconds + _SECONDS_PER_TOOTH_LAYERS * teeth)


def _blank_layers(body: GearBody, knobs: GearFidelity) -> int:
    """Return the layers of a blank without a web, or of the loads on an imported mesh."""
    if isinstance(body.blank, VolumeMesh):
        return knobs.tooth_layers(body.geometry.relative_width)
    return knobs.width_layers


def _gear_megabytes(body: GearBody, knobs: GearFidelity) -> float:
    """Memory (MB) of a gear's finite elements: its own mesh, or an imported mesh, which is solved as a whole.

    Where all teeth are alike, the matrices are those of one pitch.
    """
    if knobs.bodies != "elements":
        return 0.0
    if isinstance(body.blank, VolumeMesh):
        return _MEGABYTES_PER_UNKNOWN * 3 * len(body.blank.nodes)
    rows, refined = knobs.profile_elements / knobs.row_aspect, knobs.transverse_refinement**_REFINED_MEMORY
    coupled = body.geometry.teeth * knobs.width_layers**2 * gear.bricks_over_even(body, knobs) ** _WEB_MEMORY_GROWTH
    tooth_megabytes = (
        _MEGABYTES_PER_ALIKE_TOOTH * rows if body.sector == 1 else _MEGABYTES_PER_TOOTH * rows**_MEMORY_GROWTH
    )
    layers = knobs.tooth_layers(body.geometry.relative_width)
    points = 2 * (2 * knobs.profile_elements + 1) * (2 * layers + 1)
    condensed = _MEGABYTES_PER_TOOTH_LAYER * knobs.profile_elements * layers * refined + 3 * 8e-6 * points**2
    return max(tooth_megabytes * coupled * refined, condensed)


def recorded_time(case: GearboxCase) -> float:
    """Duration (s) of the bearing forces: the ramp, or whole turns of the slowest shaft."""
    if case.ramp is not None:
        return case.ramp.duration
    periods = [1 / min(case.shaft_orders.values())]
    for stage, pair, deviations in zip(case.stages, case.pairs, case.deviations, strict=True):
        if deviations is not None:
            periods.append(deviations.meshes(pair) / case.mesh_orders[stage.name])
    turns = Fraction(lcm(*(p.numerator for p in periods)), gcd(*(p.denominator for p in periods)))
    period = 2 * pi * float(turns) / case.operation.input_speed
    return (
        period * ceil(1 / (case.band.resolution * period))
        if len(periods) > 1
        else max(1 / case.band.resolution, period)
    )


def recorded_samples(case: GearboxCase, fidelity: Fidelity) -> float:
    """Sample count of a run-up's record."""
    knobs = fidelity.dynamics
    return recorded_time(case) / (knobs.time_step * record_stride(knobs.time_step, case.band.high, knobs))


def recorded_outputs(case: GearboxCase) -> int:
    """Count of values per sample of a run-up's record."""
    return 3 * len(case.bearings) + 3 * len(case.stages) + 1


def dynamics_step(case: GearboxCase, fidelity: Fidelity) -> PlannedStep:
    """Cost of the time integration of the gearbox."""
    knobs, meshes = fidelity.dynamics, len(case.stages)
    steps = recorded_time(case) / knobs.time_step
    run = steps * (1 if case.operation.ramp else _SETTLING_PERIODS)
    rigid = case.options.rigid_housing
    modes = 0.0 if rigid else case.housing.modes_in_reach(case, fidelity.housing)
    options, shafts = case.options, len(case.shafts)
    elastic = _ELASTIC_MOTIONS * shafts if options.models("flexible_shafts") else 0
    rows = options.face_points + 2 * options.models("friction") + options.models("shuttling")
    vibrating = vibrating_bodies(case) if options.models("gear_body_modes") else ()
    waves = sum(len(body.modes.frequency) + int((body.modes.diameters > 0).sum()) for body in vibrating)
    step_motions = (6 * shafts + modes + elastic + waves) * (1.0 + _SHARE_PER_ROW * (rows - 1))
    seconds = SECONDS_PER_STEP + _SECONDS_PER_STEP_AND_MODE * run * step_motions
    level, held = f"{meshes} tabulated meshes", 0.0
    if case.operation.ramp:
        stored = recorded_samples(case, fidelity) * recorded_outputs(case)
        record = _MEGABYTES_PER_SAMPLE_AND_OUTPUT * stored
    else:
        stored = steps * recorded_outputs(case)
        record = _MEGABYTES_PER_STEP_AND_OUTPUT * steps * (3 * len(case.bearings) + 2)
    seconds += _SECONDS_PER_SAMPLE_AND_OUTPUT * stored + _SECONDS_PER_BODY * len(vibrating)
    if knobs.mesh_level == "contact":
        level = f"the contact problem of {meshes} meshes in every step"
        solved = steps if case.operation.ramp else steps + _settling_time(case, fidelity) / knobs.time_step
        # the solvers of the contact problem compute and hold the gears' finite elements themselves
        for pair in case.pairs:
            bodies = (pair.pinion, pair.wheel)
            lines = _lines_seconds(gear.slice_count(pair, fidelity.gear))
            seconds += _body_seconds(bodies, fidelity.gear) + _LINES_PER_CONTACT_STEP * lines * solved
            held = max(held, *(_gear_megabytes(body, fidelity.gear) for body in bodies))
    return PlannedStep(
        BEARING_FORCES,
        "bearing forces",
        f"{shafts} {'flexible shafts' if elastic else 'shafts of 6 unknowns'}, "
        f"{'rigid seats' if rigid else f'about {modes:.0f} housing modes in the loop'}, {level}; steps of "
        f"{1e6 * knobs.time_step:g} µs",
        seconds,
        BASE_MEGABYTES + held + record,
    )


def _settling_time(case: GearboxCase, fidelity: Fidelity) -> float:
    """Time (s) until the start has decayed, on rigid seats and with meshes of 14 N/(mm µm), the usual c'."""
    reach = np.array([-1e-3, 1e-3])
    laws = [
        gear.tabulated(pair, np.zeros(1), reach, 14e9 * pair.wheel.geometry.face_width * reach[None, :])
        for pair in case.pairs
    ]
    knobs = replace(fidelity.dynamics, mesh_level="table")
    model = simulation(
        case.gearbox_on_rigid_seats,
        laws,
        None,
        input_torque=case.operation.input_torque,
        time_step=knobs.time_step,
        fidelity=knobs,
    )
    return settling_time(model, knobs)
