"""What gears, their meshes and the time integration take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import lcm, pi

import numpy as np

from nvhchain import gear
from nvhchain.case import GearboxCase
from nvhchain.dynamics.simulation import simulation
from nvhchain.dynamics.steady import settling_time
from nvhchain.fidelity import Fidelity, GearFidelity
from nvhchain.gear import GearBody, VolumeMesh
from nvhchain.scene.casting import modes_in_reach
from nvhchain.scene.planned import BASE_MEGABYTES, SECONDS_PER_STAGE, Stage

# Estimates: processor seconds and megabytes per unit of work, fitted to the runs in docs/measured/plan.md, which
# benchmarks/plan.py measures again.
_SECONDS_PER_TOOTH_LAYER = 1.36e-2
_SECONDS_PER_LOADED_TOOTH = 4.5e-4
_MESH_GROWTH = 0.65
_WEB_GROWTH = 0.9
_SECONDS_PER_CONTACT = 1.0e-8
_MEGABYTES_PER_TOOTH_LAYER = 3.3
_MEMORY_GROWTH = 0.35
_WEB_MEMORY_GROWTH = 0.7
_MEGABYTES_PER_UNKNOWN = 11e-3
_SECONDS_PER_STEP_AND_MODE = 7e-9
_SETTLING_PERIODS = 4
_SECONDS_PER_LOADED_ANGLE = 7.7e-3
_SECONDS_PER_CONTACT_STEP = 1e-2


def mesh_law_stages(case: GearboxCase, fidelity: Fidelity) -> list[Stage]:
    """Mesh law of every stage of the gearbox."""
    knobs, stages = fidelity.gear, []
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        bodies = (pair.pinion, pair.wheel)
        meshes, slices = lcm(*(body.sector for body in bodies)), gear.slice_count(pair, knobs)
        contacts = meshes * knobs.angles_per_mesh * knobs.deflections * (3 * slices) ** 2
        described = " and ".join(
            f"{body.geometry.teeth} teeth {type(body.blank).__name__.lower()} ({body.sector} by symmetry)"
            for body in bodies
        )
        stages.append(
            Stage(
                f"mesh law {stage.name}",
                f"{described}; {meshes * knobs.angles_per_mesh} angles × {knobs.deflections} deflections, "
                f"{slices} slices",
                _body_seconds(bodies, knobs) + _SECONDS_PER_CONTACT * contacts,
                BASE_MEGABYTES + max(_gear_megabytes(body, knobs) for body in bodies),
                {"teeth": sum(body.sector for body in bodies)},
            )
        )
    return stages


def load_distribution_stages(case: GearboxCase, fidelity: Fidelity, *, alone: bool) -> list[Stage]:
    """Where the flanks of every stage carry, for friction, shuttling and tilt.

    alone: whether the mesh laws are given; else the gears' finite elements are those of the mesh laws.
    """
    if not (case.options.load_distribution or case.options.tilt):
        return []
    stages = []
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        bodies = (pair.pinion, pair.wheel)
        angles = lcm(*(body.sector for body in bodies)) * fidelity.gear.angles_per_mesh
        models = f"{angles} angles under the nominal force"
        seconds, megabytes = _SECONDS_PER_LOADED_ANGLE * angles, BASE_MEGABYTES
        if alone:
            seconds += _body_seconds(bodies, fidelity.gear)
            megabytes += max(_gear_megabytes(body, fidelity.gear) for body in bodies)
        stages.append(Stage(f"load distribution {stage.name}", models, seconds, megabytes))
    return stages


def _body_seconds(bodies: Sequence[GearBody], knobs: GearFidelity) -> float:
    """Of the finite elements of a pair of gears."""
    if knobs.bodies != "elements":
        return 0.0
    layers = [
        body.geometry.teeth * knobs.width_layers * gear.bricks_over_even(body, knobs) ** _WEB_GROWTH for body in bodies
    ]
    loaded = sum((body.sector - 1) * layer for body, layer in zip(bodies, layers, strict=True))
    fineness = knobs.profile_elements / knobs.row_aspect
    return float(fineness**_MESH_GROWTH * (_SECONDS_PER_TOOTH_LAYER * sum(layers) + _SECONDS_PER_LOADED_TOOTH * loaded))


def _gear_megabytes(body: GearBody, knobs: GearFidelity) -> float:
    """Of a gear's finite elements: of its own mesh, or of a mesh of another program, which is solved as a whole."""
    if knobs.bodies != "elements":
        return 0.0
    if isinstance(body.blank, VolumeMesh):
        return _MEGABYTES_PER_UNKNOWN * 3 * len(body.blank.nodes)
    fineness = knobs.profile_elements / knobs.row_aspect
    layers = body.geometry.teeth * knobs.width_layers * gear.bricks_over_even(body, knobs) ** _WEB_MEMORY_GROWTH
    return _MEGABYTES_PER_TOOTH_LAYER * layers * fineness**_MEMORY_GROWTH


def recorded_time(case: GearboxCase) -> float:
    """s of bearing forces: the ramp, or whole turns of the slowest shaft."""
    if case.operation.ramp is not None:
        return case.operation.ramp.duration
    turns = 1 / min(case.shaft_orders.values())
    return max(1 / case.band.resolution, 2 * pi * float(turns) / case.operation.input_speed)


def dynamics_stage(case: GearboxCase, fidelity: Fidelity) -> Stage:
    """Time integration of the gearbox."""
    knobs, meshes = fidelity.dynamics, len(case.stages)
    steps = recorded_time(case) / knobs.time_step
    run = steps * (1 if case.operation.ramp else _SETTLING_PERIODS)
    rigid = case.options.rigid_housing
    modes = 0.0 if rigid else modes_in_reach(case, fidelity)
    seconds = SECONDS_PER_STAGE + _SECONDS_PER_STEP_AND_MODE * run * (6 * len(case.shafts) + modes)
    level, held = f"{meshes} tabulated meshes", 0.0
    if knobs.mesh_level == "stiffness":
        level = f"{meshes} mesh stiffnesses over the angle" + ", flanks that part" * knobs.contact_loss
    if knobs.mesh_level == "contact":
        level = f"the contact problem of {meshes} meshes in every step"
        solved = steps if case.operation.ramp else steps + _settling_time(case, fidelity) / knobs.time_step
        seconds += _SECONDS_PER_CONTACT_STEP * meshes * solved
        # its solvers hold the gears' finite elements, which they make for themselves
        for pair in case.pairs:
            bodies = (pair.pinion, pair.wheel)
            seconds += _body_seconds(bodies, fidelity.gear)
            held = max(held, *(_gear_megabytes(body, fidelity.gear) for body in bodies))
    return Stage(
        "bearing forces",
        f"{len(case.shafts)} shafts of 6 unknowns, "
        f"{'rigid seats' if rigid else f'about {modes:.0f} housing modes in the loop'}, {level}; steps of "
        f"{1e6 * knobs.time_step:g} µs",
        seconds,
        BASE_MEGABYTES + held + 8e-6 * steps * (3 * len(case.bearings) + 2) * 6,
    )


def _settling_time(case: GearboxCase, fidelity: Fidelity) -> float:
    """s in which the start is forgotten, on rigid seats and with meshes of 14 N/(mm µm), the usual c'."""
    reach = np.array([-1e-3, 1e-3])
    laws = [
        gear.tabulated(pair, np.zeros(1), reach, 14e9 * pair.wheel.geometry.face_width * reach[None, :])
        for pair in case.pairs
    ]
    knobs = replace(fidelity.dynamics, mesh_level="table", settle_time=1e5)
    model = simulation(
        case.gearbox_with_gears,
        laws,
        None,
        input_torque=case.operation.input_torque,
        time_step=knobs.time_step,
        fidelity=knobs,
    )
    return settling_time(model, knobs)
