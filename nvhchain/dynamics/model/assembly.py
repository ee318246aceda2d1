"""Linear part of the gearbox: shafts on bearings in series with the reduced housing, and the lines of action.

The unknowns x are, in this order:

- five per shaft: translations of its centre of mass along x, y, z, and tilts about x, y;
- the housing's modal coordinates;
- the elastic motions of flexible shafts;
- the waves of gear bodies that vibrate (`gear_bodies`);
- torsional coordinates τ, one less than there are rotors in the train: shafts, and loose gears on them.

The spins φ = free τ add to the prescribed nominal spin, positive in each shaft's running direction. The common spin of
the train is omitted, because the torques balance in it. A loose gear has the motions of its shaft but for its own spin;
a shaft that carries loose gears only stands still. Bearings leave the spin free and sit on the shaft axes, so τ
couples to the other unknowns only in the gear meshes. Weight is neglected. Gyroscopic terms hold for one given speed.

Contact rows come in pairs, of a drive flank and a back flank (`mesh_rows`). Contact i is pressed by d_i = contact[i] ·
x, and its force F_i ≥ 0 acts back on x as −contact[i] F_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh, null_space

from nvhchain.dynamics.model.bearing_series import BearingSeries, bearing_series, motions_of
from nvhchain.dynamics.model.gear_bodies import add_body_waves, relieved
from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.mesh_rows import all_wrenches, error_wrenches, tilt_wrenches
from nvhchain.dynamics.model.parts import Bearing
from nvhchain.dynamics.model.sections import Sections, Wrench, sections
from nvhchain.dynamics.model.shafts import Shaft
from nvhchain.dynamics.model.train import Train, train, train_inertia
from nvhchain.errors import InputError, require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray, IntArray, MeshLaw, ReducedHousing

SEAT_TOLERANCE = 1e-3
"""Largest distance (m) of a bearing from the housing's seat of the same name: a modelling gap, not accuracy."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """Matrices of the gearbox; n = 5 n_shaft + n_mode + n_elastic + n_wave + n_torsion.

    Rotors are the shafts, then the loose gears.

    mass : (n,) mass of the unknowns.
    stiffness, damping : (n, n) with bearings and housing, without meshes. Gyroscopic terms are the skew part of the
        damping.
    gyroscopic : (n, n) gyroscopic terms per rad/s of the input.
    input_speed : speed of the input in the damping's gyroscopic terms (rad/s).
    contact : (2 n_row, n) pairs of contact rows.
    mesh : (n_row,) index of the mesh of each pair.
    share : (n_row,) share of the pair in the mesh's force; 0 for friction and shuttling.
    offset : (n_row,) distance of the pair from mid-width along z (m).
    misalignment : (2 n_mesh, n) tilts of each wheel against its pinion (rad; `tilt_wrenches`).
    mesh_error : (n_mesh, n) transmission error of each mesh (m; `error_wrenches`).
    torques : (n_rotor, n) rotation of each shaft where its torques enter, and of each loose gear, along its running
        direction.
    bearing_stiffness, bearing_damping : (motions · n_bearing, n) with the force and the moment of a bearing on the
        housing = stiffness x + damping ẋ, and a constant (`wrenches`).
    bearings : series of bearings and seats.
    bearing_map : (n_bearing motions, n) displacement of the shafts against the seats.
    own_stiffness : (n_lateral,) stiffness of the unknowns without bearings.
    links : bearings between shafts, as a series without seats.
    link_map : (n_link motions, n) displacement of their inner shafts against the outer ones.
    elastic_shaft : (n_elastic,) index of the shaft of each elastic motion.
    sections : cross-sections of the shafts.
    side_load : (n,) generalised force of the constant loads on the shafts.
    seat_shapes : (motions · n_bearing, n_mode) mode shapes at the seats, in the order of the bearings.
    seat_residual : (motions · n_bearing, motions · n_bearing) residual flexibility of the seats.
    inertia : (n_rotor,) inertia about z (kg m²).
    free : (n_rotor, n_torsion) spins per unit τ, of unit kinetic energy and orthogonal to the common spin of the
        train.
    coupling : (n, n) inertia between waves and other unknowns, beside `mass`; None without vibrating gear bodies.
    softening : (n,) fall of the stiffness per (rad/s)² of the input; None likewise.
    body_compliance : (n_mesh, 2) static compliance (m/N) of the gear bodies' modes at drive and back flank.
    body_of_wave : (n_wave,) index of the body of each coordinate of a wave.
    """

    gearbox: Gearbox
    train: Train
    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    gyroscopic: FloatArray
    input_speed: float
    contact: FloatArray
    mesh: IntArray
    share: FloatArray
    offset: FloatArray
    misalignment: FloatArray
    mesh_error: FloatArray
    torques: FloatArray
    bearing_stiffness: FloatArray
    bearing_damping: FloatArray
    seat_shapes: FloatArray
    seat_residual: FloatArray
    inertia: FloatArray
    free: FloatArray
    bearings: BearingSeries
    bearing_map: FloatArray
    own_stiffness: FloatArray
    links: BearingSeries
    link_map: FloatArray
    elastic_shaft: IntArray
    sections: Sections
    side_load: FloatArray
    coupling: FloatArray | None = None
    softening: FloatArray | None = None
    body_compliance: FloatArray | None = None
    body_of_wave: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def lateral(self) -> int:
        """Number of unknowns before the torsional ones."""
        return len(self.mass) - self.free.shape[1]

    @property
    def waves(self) -> slice:
        """Unknowns of the waves around gear bodies."""
        return slice(self.lateral - len(self.body_of_wave), self.lateral)

    @property
    def transmission_error(self) -> FloatArray:
        """Row (n,) of the whole gearbox: angle (rad) by which the output lags behind the input where torques enter."""
        box = self.gearbox
        first, last = box.rotor_index(box.input_shaft), box.rotor_index(box.output_shaft)
        return np.asarray(float(self.train.speed_ratio[last]) * self.torques[first] - self.torques[last])

    def load(self, torque: FloatArray) -> FloatArray:
        """Return the generalised force (n,) of external torques (n_rotor,) (N m) along the running directions.

        It includes the constant loads on the shafts, and the constant forces of bearings that are linear about a point
        of operation.
        """
        load = np.asarray(self.torques.T @ torque + self.side_load)
        for series, motion in ((self.bearings, self.bearing_map), (self.links, self.link_map)):
            load = load if series.preload is None else load - motion.T @ series.preload
        return load

    @property
    def mass_matrix(self) -> FloatArray:
        """Mass (n, n) of the unknowns, with the coupling of waves."""
        return np.diag(self.mass) if self.coupling is None else np.diag(self.mass) + self.coupling

    def opposed(self, face_moment: FloatArray) -> Assembly:
        """Return the assembly whose teeth oppose the tilt in the plane of action with moments (n_mesh,) (N m)."""
        return replace(self, side_load=self.side_load - self.misalignment[::2].T @ face_moment)

    def wrenches(self, force: FloatArray) -> FloatArray:
        """Return forces and moments (n, n_bearing, motions) on the housing with their constant part (N, N m).

        force : (n, motions · n_bearing) without it.
        """
        constant = 0.0 if self.bearings.preload is None else self.bearings.preload
        return np.asarray((force + constant).reshape(len(force), -1, self.bearings.motions))

    def set_speed(self, input_speed: float) -> Assembly:
        """Return the assembly with the gyroscopic terms of another input speed (rad/s)."""
        damping = self.damping + (input_speed - self.input_speed) * self.gyroscopic
        if self.softening is None:
            return replace(self, damping=damping, input_speed=input_speed)
        stiffness = self.stiffness - np.diag((input_speed**2 - self.input_speed**2) * self.softening)
        require(
            bool((np.diag(stiffness)[self.waves] > 0.0).all()),
            f"at {input_speed:g} rad/s of the input a gear turns faster than a wave around its body: lower the speed, "
            "or leave gear_body_modes off",
        )
        return replace(self, damping=damping, stiffness=stiffness, input_speed=input_speed)

    def times_mass(self, shapes: Any) -> Any:
        """Return mass times motions (n, …)."""
        product = (self.mass * shapes.T).T
        return product if self.coupling is None else product + self.coupling @ shapes

    def accelerations(self, force: FloatArray) -> FloatArray:
        """Return the accelerations (n, …) under generalised forces (n, …)."""
        if self.coupling is None:
            return np.asarray((force.T / self.mass).T)
        return np.asarray(np.linalg.solve(self.mass_matrix, force))

    def undamped_modes(self, contact_stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return squared frequencies (n,) (rad²/s²) and mass-normalised shapes (n, n), without gyroscopic terms.

        contact_stiffness : (2 n_row,) stiffness of the contacts (N/m).
        """
        stiffness = self.stiffness + (self.contact.T * contact_stiffness) @ self.contact
        if self.coupling is not None:
            squared, shapes = eigh(stiffness, self.mass_matrix)
            return squared, shapes
        root = 1.0 / np.sqrt(self.mass)
        squared, shapes = eigh(root[:, None] * stiffness * root)
        return squared, root[:, None] * shapes

    def laws_beside_waves(self, mesh_laws: Sequence[MeshLaw]) -> Sequence[MeshLaw]:
        """Return the laws without the static compliance that the waves of the gear bodies have."""
        if self.body_compliance is None:
            return mesh_laws
        return [relieved(law, each) for law, each in zip(mesh_laws, self.body_compliance, strict=True)]


def assemble(
    gearbox: Gearbox,
    mesh_laws: Sequence[MeshLaw],
    housing: ReducedHousing | None,
    *,
    input_speed: float = 0.0,
    fidelity: DynamicsFidelity | None = None,
) -> Assembly:
    """Assemble shafts, bearings, housing and lines of action.

    housing : reduced housing; None for rigid seats.
    input_speed : speed of the input for gyroscopic terms (rad/s); 0 omits them.
    fidelity : elements and modes of flexible shafts; None for rigid shafts.

    The seats' residual flexibility R is in series with the bearings (PHYSICS: series of bearing and seat):

        K_eff = (K_b⁻¹ + R)⁻¹,    C_eff = K_eff K_b⁻¹ C_b K_b⁻¹ K_eff.

    This is of first order in the damping of the exact complex series (`bearing_series`).

    Raises InputError if bearings, seats, axes and laws do not fit together, or a shaft can move freely. Also if the
    stiffness of a bearing depends on its load.
    """
    kinematics = train(gearbox, mesh_laws)
    bearings, n_shaft = gearbox.bearings, len(gearbox.shafts)
    n_mode = 0 if housing is None else len(housing.natural_frequency)
    shapes, residual, modal_stiffness, modal_damping = _housing_matrices(gearbox, housing)

    contacts, row_mesh, share, offset = all_wrenches(gearbox, kinematics, mesh_laws, gearbox.face_points)
    series = bearing_series(bearings, residual)
    seats = [
        Wrench(gearbox.shaft_index(bearing.shaft), bearing.z, push)
        for bearing in bearings
        for push in np.eye(6)[: series.motions]
    ]
    twists = [
        Wrench(i, shaft.torque_plane, np.array([0.0, 0.0, 0.0, 0.0, 0.0, float(turn)]))
        for i, (shaft, turn) in enumerate(zip(gearbox.shafts, kinematics.rotation, strict=False))
    ]
    loose = [(i, gear, gearbox.shaft_index(gear.name)) for i, gear in enumerate(gearbox.loose_gears, start=n_shaft)]
    spun = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    twists += [Wrench(carrier, gear.body.z, kinematics.rotation[i] * spun, i) for i, gear, carrier in loose]
    pairs = gearbox.shaft_bearings
    links = bearing_series(pairs, np.zeros((motions_of(pairs) * len(pairs),) * 2))
    link_wrenches = [
        [
            Wrench(gearbox.shaft_index(bearing.shaft), bearing.z, push),
            Wrench(gearbox.shaft_index(bearing.outer_shaft), bearing.z, -push),
        ]
        for bearing in gearbox.shaft_bearings
        for push in np.eye(6)[: links.motions]
    ]
    pulls = [
        Wrench(i, load.z, np.array([*load.force, *load.moment, 0.0]))
        for i, shaft in enumerate(gearbox.shafts)
        for load in shaft.loads
    ]
    shafts = sections(
        [_laden(gearbox, shaft) for shaft in gearbox.shafts],
        kinematics.rotation,
        5 * n_shaft + n_mode,
        [*seats, *twists, *pulls, *(wrench for row in (*contacts, *link_wrenches) for wrench in row)],
        element=fidelity.shaft_element if fidelity is not None and gearbox.flexible_shafts else 0.0,
        frequency=fidelity.shaft_frequency if fidelity is not None else 0.0,
    )
    modes = slice(5 * n_shaft, 5 * n_shaft + n_mode)
    bearing_map = np.array([shafts.rows([wrench])[0] for wrench in seats])
    bearing_map[:, modes] = -shapes
    k_eff, c_eff = series.stiffness, series.damping

    mass, own_stiffness, own_damping = _uncoupled_matrices(gearbox, shafts, modal_stiffness, modal_damping)
    link_map = np.array([shafts.rows(ends)[0] for ends in link_wrenches]).reshape(-1, len(mass))
    stiffness = np.diag(own_stiffness) + bearing_map.T @ k_eff @ bearing_map
    stiffness += link_map.T @ links.stiffness @ link_map
    damping = np.diag(own_damping) + bearing_map.T @ c_eff @ bearing_map
    damping += link_map.T @ links.damping @ link_map
    lowest, *_, highest = np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))
    if lowest <= 1e-12 * highest:
        raise InputError(
            "a shaft can move freely on its bearings: give every shaft two bearings that also hold it along z"
        )

    inertia = rotor_inertia(gearbox)
    ratio = np.array([float(ratio) for ratio in kinematics.speed_ratio])
    turning = ratio > 0.0
    # common spin r: the speed ratios. rᵀJN = 0 and NᵀJN = I, so J^½ N is orthonormal and normal to J^½ r
    root = np.sqrt(inertia[turning])
    free = np.zeros((len(inertia), len(root) - 1))
    free[turning] = null_space((root * ratio[turning])[None, :]) / root[:, None]
    n_torsion = free.shape[1]

    def contact_rows(contacts: Sequence[Sequence[Wrench]]) -> FloatArray:
        rows = [shafts.rows(wrenches) for wrenches in contacts]
        return np.array([np.concatenate([force, torque @ free]) for force, torque in rows])

    def widened(rows: FloatArray) -> FloatArray:
        return np.hstack([rows, np.zeros((len(rows), n_torsion))])

    speeds = np.array(kinematics.rotation) * ratio
    gyroscopic = shafts.gyroscopic(speeds[:n_shaft])
    for i, gear, carrier in loose:
        tilt_x, tilt_y = (shafts.rows([Wrench(carrier, gear.body.z, push)])[0] for push in np.eye(6)[3:5])
        momentum = speeds[i] * gear.body.polar_inertia
        gyroscopic += momentum * (np.outer(tilt_x, tilt_y) - np.outer(tilt_y, tilt_x))
    gyroscopic = np.pad(gyroscopic, (0, n_torsion))
    rigid = Assembly(
        gearbox=gearbox,
        train=kinematics,
        mass=np.concatenate([mass, np.ones(n_torsion)]),
        stiffness=np.pad(stiffness, (0, n_torsion)),
        damping=np.pad(damping, (0, n_torsion)),
        gyroscopic=gyroscopic,
        input_speed=0.0,
        contact=contact_rows(contacts),
        mesh=row_mesh,
        share=share,
        offset=offset,
        misalignment=contact_rows(
            [
                tilt
                for mesh, law in zip(gearbox.meshes, mesh_laws, strict=True)
                for tilt in tilt_wrenches(gearbox, kinematics, mesh, law)
            ]
        ),
        mesh_error=contact_rows(
            [
                error_wrenches(gearbox, kinematics, mesh, law)
                for mesh, law in zip(gearbox.meshes, mesh_laws, strict=True)
            ]
        ),
        torques=contact_rows([[twist] for twist in twists]),
        bearing_stiffness=widened(k_eff @ bearing_map),
        bearing_damping=widened(c_eff @ bearing_map),
        seat_shapes=shapes,
        seat_residual=residual,
        inertia=inertia,
        free=free,
        sections=shafts,
        side_load=contact_rows([pulls])[0],
        bearings=series,
        bearing_map=widened(bearing_map),
        own_stiffness=own_stiffness,
        links=links,
        link_map=widened(link_map),
        elastic_shaft=np.repeat(np.arange(n_shaft), [len(e.squared) for e in shafts.elastic or ()] or 0),
    )
    held = [0.0 if mesh.static_tilt is None else mesh.static_tilt.moment for mesh in gearbox.meshes]
    return add_body_waves(rigid, mesh_laws).set_speed(input_speed).opposed(np.array(held))


def rotor_inertia(gearbox: Gearbox) -> FloatArray:
    """Return the inertia (n_rotor,) about z of the shafts, with their couplings, and of the loose gears (kg m²)."""
    shafts = [_laden(gearbox, shaft).inertia().polar_inertia + shaft.coupled_inertia for shaft in gearbox.shafts]
    return np.array([*shafts, *(gear.body.polar_inertia for gear in gearbox.loose_gears)])


def input_inertia(gearbox: Gearbox, mesh_laws: Sequence[MeshLaw]) -> float:
    """Return the inertia of the train seen from the input (kg m²)."""
    return train_inertia(train(gearbox, mesh_laws), rotor_inertia(gearbox))


def _laden(gearbox: Gearbox, shaft: Shaft) -> Shaft:
    """Return a shaft with the mass and the transverse inertia of its loose gears, which do not turn with it."""
    carried = [replace(gear.body, polar_inertia=0.0) for gear in gearbox.loose_gears if gear.shaft == shaft.name]
    return replace(shaft, bodies=shaft.bodies + tuple(carried)) if carried else shaft


def _housing_matrices(gearbox: Gearbox, housing: ReducedHousing | None) -> tuple[FloatArray, ...]:
    """Return seat shapes (m, n_mode) and residual (m, m), modal stiffness and damping; m = motions · n_bearing.

    Seats of a housing without tilts do not tilt.
    """
    count, motions = len(gearbox.bearings), motions_of(gearbox.bearings)
    size = motions * count
    if housing is None:
        return np.zeros((size, 0)), np.zeros((size, size)), np.zeros(0), np.zeros(0)
    seats, n_mode = _seats(gearbox.bearings, gearbox, housing), len(housing.natural_frequency)
    require(
        n_mode == 0 or housing.natural_frequency[0] > 0,
        "the housing has a rigid-body mode (0 Hz): fix it at its bolts before it goes into the gearbox",
    )
    known = min(motions, housing.motions)
    shapes, residual = np.zeros((n_mode, count, motions)), np.zeros((count, motions, count, motions))
    shapes[:, :, :known] = housing.seat_shapes[:, seats, :known]
    residual[:, :known, :, :known] = housing.seat_residual[seats][:, :known, seats, :known]
    flexible = residual.reshape(size, size)
    omega = 2.0 * np.pi * housing.natural_frequency
    return (
        shapes.reshape(n_mode, size).T,
        0.5 * (flexible + flexible.T),
        omega**2,
        2.0 * housing.modal_damping * omega,
    )


def _uncoupled_matrices(
    gearbox: Gearbox, shafts: Sections, modal_stiffness: FloatArray, modal_damping: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mass, stiffness and damping of the unknowns by themselves, without torsion."""
    bodies = shafts.bodies
    rigid = np.array([[b.mass] * 3 + [b.transverse_inertia] * 2 for b in bodies]).ravel()
    require(bool((rigid > 0).all()), "a shaft has no transverse inertia: give its segments or bodies one")
    squared = np.concatenate([np.zeros(0), *(elastic.squared for elastic in shafts.elastic or ())])
    ratio = (
        np.repeat(
            [shaft.modal_damping for shaft in gearbox.shafts],
            [len(elastic.squared) for elastic in shafts.elastic or ()],
        )
        if shafts.elastic
        else np.zeros(0)
    )
    still = np.zeros(len(rigid))
    return (
        np.concatenate([rigid, np.ones(len(modal_stiffness) + len(squared))]),
        np.concatenate([still, modal_stiffness, squared]),
        np.concatenate([still, modal_damping, 2.0 * ratio * np.sqrt(squared)]),
    )


def _seats(bearings: Sequence[Bearing], gearbox: Gearbox, housing: ReducedHousing) -> list[int]:
    seats = []
    for bearing, position in zip(bearings, gearbox.bearing_positions, strict=True):
        require(
            bearing.name in housing.names,
            f"bearing {bearing.name} has no seat in the housing; its seats: {', '.join(housing.names)}",
        )
        seat = housing.names.index(bearing.name)
        gap = float(np.linalg.norm(np.array(position) - housing.positions[seat]))
        require(
            gap <= SEAT_TOLERANCE,
            f"bearing {bearing.name} lies {1e3 * gap:.3g} mm from its seat in the housing (limit "
            f"{1e3 * SEAT_TOLERANCE:g} mm): "
            "align shaft axis, bearing z and bore",
        )
        seats.append(seat)
    return seats
