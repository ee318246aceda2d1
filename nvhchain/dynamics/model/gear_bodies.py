"""Gear bodies that vibrate: waves around the axis of a gear as unknowns of the gearbox.

With Ω of the gear about +z, a wave P of n nodal diameters, natural frequency ω and Coriolis factor σ obeys

    P̈ − 2j(n − σ)Ω Ṗ + 2ζω Ṗ + (ω² − (n² − 2nσ)Ω²) P + inertia · ẍ = −a F,    deflection of the mesh += Re(a* P).

a is the motion of the teeth out of their flank at the pitch point. The derivation stands in
docs/decisions/0021-gear-bodies-vibrate.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import block_diag

from nvhchain.dynamics.model.mesh_rows import ends, flank_normals
from nvhchain.dynamics.model.parts import VibratingBody
from nvhchain.dynamics.model.sections import Wrench
from nvhchain.errors import require
from nvhchain.handoff import BodyModes, FloatArray, IntArray, MeshLaw

if TYPE_CHECKING:
    from nvhchain.dynamics.model.assembly import Assembly

LARGEST_PART = 0.95
"""Largest part of a law's compliance that the modes of its gears may hold; the rest is then of the size of the errors
of both."""


def add_body_waves(assembly: Assembly, mesh_laws: Sequence[MeshLaw]) -> Assembly:
    """Return the assembly of rigid gears with the waves of its gear bodies, which come before the torsional unknowns.

    Raises InputError if waves hold more inertia than their shaft.
    """
    bodies = assembly.gearbox.gear_bodies
    if not bodies:
        return assembly
    n, lateral = len(assembly.mass), assembly.lateral
    body_terms = [_body_terms(assembly, body) for body in bodies]
    parts = list(zip(*body_terms, strict=True))
    squared, damping, softening, inertia, turned, common = (np.concatenate(part) for part in parts[:6])
    skew = block_diag(*parts[6])
    m = len(squared)
    own = np.arange(lateral, lateral + m)
    others = np.delete(np.arange(n + m), own)

    def widened(rows: FloatArray) -> FloatArray:
        return np.insert(rows, [lateral] * m, 0.0, axis=-1)

    def spread(matrix: FloatArray) -> FloatArray:
        return np.insert(widened(matrix), [lateral] * m, 0.0, axis=0)

    coupling, gyroscopic = np.zeros((n + m, n + m)), spread(assembly.gyroscopic * assembly.gearbox.gyroscopic)
    coupling[np.ix_(own, others)], coupling[np.ix_(others, own)] = inertia, inertia.T
    # no force acts along the common spin of the train, which follows the waves and is no unknown
    ratio = np.array([float(each) for each in assembly.train.speed_ratio])
    coupling[np.ix_(own, own)] = -np.outer(common, common) / float(assembly.inertia @ ratio**2)
    gyroscopic[np.ix_(own, own)] = skew
    gyroscopic[np.ix_(own, others)], gyroscopic[np.ix_(others, own)] = turned, -turned.T
    contact, compliance = widened(assembly.contact), np.zeros((len(mesh_laws), 2))
    pushes = np.zeros((len(mesh_laws), 2, m))
    first = 0
    for body, part in zip(bodies, body_terms, strict=True):
        size = len(part[0])
        for mesh, side in body.ends:
            pushes[mesh, :, first : first + size] = _pushes(assembly, body.modes, mesh, side, mesh_laws[mesh])
        first += size
    held = np.repeat([body.held_by_law for body in bodies], [len(part[0]) for part in body_terms])
    compliance = (pushes**2 * held / squared).sum(axis=2)
    for mesh, law in enumerate(mesh_laws):
        points = np.flatnonzero((assembly.mesh == mesh) & (assembly.share > 0.0))
        rows = np.array([2 * points, 2 * points + 1])
        # the law relieved of the modes is stiffer; against tilt, which moves no wave, the points keep that of the law
        middle = np.average(contact[rows], axis=1, weights=assembly.share[points])[:, None]
        contact[rows] = middle + np.sqrt(1.0 - _part(law, compliance[mesh])) * (contact[rows] - middle)
        contact[rows[:, :, None], own] = pushes[mesh][:, None]
    mass = np.insert(assembly.mass, [lateral] * m, 1.0)
    require(
        bool(np.linalg.eigvalsh((np.diag(mass) + coupling) / np.sqrt(np.outer(mass, mass)))[0] > 0.0),
        "the modes of gear bodies hold more inertia than their shafts: add the gears to the bodies of the shafts",
    )
    stiffness, own_damping = spread(assembly.stiffness), spread(assembly.damping)
    stiffness[own, own], own_damping[own, own] = squared, damping
    return replace(
        assembly,
        mass=mass,
        stiffness=stiffness,
        damping=own_damping,
        gyroscopic=gyroscopic,
        contact=contact,
        own_stiffness=np.concatenate([assembly.own_stiffness, squared]),
        link_map=widened(assembly.link_map),
        coupling=coupling,
        softening=np.insert(np.zeros(n), [lateral] * m, softening),
        body_compliance=compliance,
        body_of_wave=np.repeat(np.arange(len(bodies)), [len(part[0]) for part in body_terms]),
        misalignment=widened(assembly.misalignment),
        mesh_error=widened(assembly.mesh_error),
        torques=widened(assembly.torques),
        side_load=widened(assembly.side_load[None])[0],
        bearing_stiffness=widened(assembly.bearing_stiffness),
        bearing_damping=widened(assembly.bearing_damping),
        bearing_map=widened(assembly.bearing_map),
    )


def _part(law: MeshLaw, compliance: FloatArray) -> float:
    """Return the part of the mean compliance of the loaded flank that its modes hold, at most LARGEST_PART."""
    force = law.force.mean(axis=0)
    flank = int(force[-1] < -force[0])
    end = (-1, 0)[flank]
    slope = np.gradient(force, law.deflection)[end]
    return float(min(LARGEST_PART, compliance[flank] * slope))


def _split(diameters: IntArray, amplitude: Any) -> FloatArray:
    """Return complex rows (waves, …) as rows of the real coordinates: Re P, and Im P with nodal diameters."""
    rows = []
    for n, each in zip(diameters, amplitude, strict=True):
        rows += [each.real, each.imag] if n else [each.real]
    return np.array(rows).reshape(-1, *amplitude.shape[1:])


def _body_terms(assembly: Assembly, body: VibratingBody) -> tuple[FloatArray, ...]:
    """Return the terms of a body over its m real coordinates.

    The first are squared frequencies, damping, and the fall of the squared frequencies per squared speed of the input.
    With the n other unknowns the waves share inertia (m, n), and gyroscopic terms (m, n) per speed of the input.
    Inertia (m,) is shared with the common spin. The last are gyroscopic terms (m, m) among the waves.
    """
    box, modes = assembly.gearbox, body.modes
    shaft, rotor = box.shaft_index(body.rotor), box.rotor_index(body.rotor)
    spin = assembly.train.rotation[rotor] * float(assembly.train.speed_ratio[rotor])
    free, sections = assembly.free, assembly.sections
    # the section that carries the rigid body carries the waves: a flexible shaft has little inertia of its own
    centre = min((each.z for each in box.shafts[shaft].bodies), key=lambda z: abs(z - body.z), default=body.z)
    arm = np.array([0.0, 0.0, body.z - centre])
    wrenches = [
        Wrench(shaft, centre, push + np.append(np.zeros(3), np.cross(arm, push[:3])), -1 if rotor == shaft else rotor)
        for push in np.eye(6)
    ]
    moves = [sections.rows([each]) for each in wrenches]
    motions = [np.concatenate([on, spins @ free]) for on, spins in moves]
    train = float(moves[5][1] @ [float(ratio) for ratio in assembly.train.speed_ratio])
    n, hub, omega = modes.diameters, modes.hub, 2.0 * np.pi * modes.frequency
    moved, tilted = motions[0] + 1j * motions[1], motions[3] + 1j * motions[4]
    still, once = (n == 0)[:, None], (n == 1)[:, None]
    inertia = still * (hub[:, :1] * motions[2] + hub[:, 1:2] * motions[5])
    inertia = inertia + once * (hub[:, :1] * moved + hub[:, 1:2] * tilted)
    turned = once * (-2j * spin * hub[:, 2:] * tilted)
    blocks = [
        2.0 * spin * (k - factor) * np.array([[0.0, 1.0], [-1.0, 0.0]]) if k else np.zeros((1, 1))
        for k, factor in zip(n, modes.coriolis, strict=True)
    ]
    both = 1.0 + 1.0j
    return (
        _split(n, both * omega**2),
        _split(n, both * 2.0 * body.damping * omega),
        _split(n, both * (n**2 - 2.0 * n * modes.coriolis) * spin**2),
        _split(n, inertia),
        _split(n, turned),
        _split(n, (n == 0) * hub[:, 1] * train),
        block_diag(*blocks),
    )


def _pushes(assembly: Assembly, modes: BodyModes, mesh: int, side: int, law: MeshLaw) -> FloatArray:
    """Return the motion (2, m) of a gear's teeth against unit forces on drive and back flank at the pitch point."""
    pair = ends(assembly.gearbox, assembly.train, assembly.gearbox.meshes[mesh])
    normals = flank_normals(pair[0].axis, pair[1].axis, law, pair[0].turn)
    away = (pair[1].axis - pair[0].axis) * (1.0, -1.0)[side]
    angle = float(np.arctan2(away[1], away[0]))
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    found = []
    for normal in normals:
        force = axes @ normal * (1.0, -1.0)[side]
        found.append(_split(modes.diameters, modes.rim @ force * np.exp(1j * modes.diameters * angle)))
    return np.array(found)


def relieved(law: MeshLaw, compliance: FloatArray) -> MeshLaw:
    """Return a law without the static compliance of the modes of its gears.

    compliance : (2,) compliance (m/N) of drive and back flank.

    Raises InputError if the law is hardly softer than that.
    """
    if not compliance.any():
        return law
    reached = law.deflection - np.where(law.force > 0.0, compliance[0], compliance[1]) * law.force
    step = np.diff(law.deflection)
    left = float((np.diff(reached, axis=1) / step).min())
    require(
        left >= 1.0 - LARGEST_PART,
        f"mesh law with teeth {law.teeth}: the modes of its gears hold {1.0 - left:.0%} of its compliance (limit "
        f"{LARGEST_PART:.0%}), and the rest is within the errors of both: stiffen the web, or set gear_body_modes = "
        "false; a supplied law must hold the bodies of its gears",
    )
    grid = reached.mean(axis=0)
    extension = float(np.ptp(law.deflection))
    rows = []
    for deflection, force in zip(reached, law.force, strict=True):
        slope = np.diff(force)[[0, -1]] / np.diff(deflection)[[0, -1]] * extension
        rows.append(
            np.interp(
                grid,
                np.concatenate([[deflection[0] - extension], deflection, [deflection[-1] + extension]]),
                np.concatenate([[force[0] - slope[0]], force, [force[-1] + slope[1]]]),
            )
        )
    return law.replace(deflection=grid, force=np.maximum.accumulate(np.array(rows), axis=1))
