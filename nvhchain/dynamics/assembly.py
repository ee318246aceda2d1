"""The linear part of the gearbox: rigid shafts on bearings in series with the reduced housing, and the lines of
action.

Unknowns x, in this order: five per shaft (translations of its centre of mass along x, y, z; tilts about x, y), the
housing's modal coordinates, and n_shaft − 1 torsional coordinates τ. The spins φ = free τ, positive in each
shaft's running direction, come on top of the prescribed nominal spin: the common spin of the train is left out,
since the torques balance in it. Bearings leave rotations free and sit on the shaft axes, so τ meets the other
unknowns only in the gear meshes.
Weight is left out. Gyroscopic terms belong to one speed: they come in where it is given.

Contacts: two per mesh, first its drive flank, then its back flank. Contact i is pressed by d_i = contact[i] · x and
its force F_i ≥ 0 acts back on x as −contact[i] F_i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from nvhchain.dynamics.gearbox import Bearing, Gearbox, Mesh, RigidBody
from nvhchain.dynamics.train import Train, train
from nvhchain.errors import InputError, require
from nvhchain.handoff import FloatArray, MeshLaw, ReducedHousing

SEAT_TOLERANCE = 1e-3
"""m: how far a bearing of the gearbox may lie from the housing's seat of the same name (a modelling gap, not
accuracy)."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """Matrices of the gearbox; n = 5 n_shaft + n_mode + (n_shaft − 1).

    mass (n,), stiffness (n, n), damping (n, n): bearings and housing included, meshes not. The gyroscopic terms are the
    skew part of the damping.
    contact (2 n_mesh, n): contact rows, above.
    bearing_stiffness, bearing_damping (3 n_bearing, n): bearing force on the housing = stiffness x + damping ẋ.
    seat_shapes (3 n_bearing, n_mode), seat_residual (3 n_bearing, 3 n_bearing): of the bearings in their order.
    inertia (n_shaft,): kg m² about z.  free (n_shaft, n_shaft − 1): spins per unit τ, unit in kinetic energy and
    orthogonal to the common spin of the train.
    """

    gearbox: Gearbox
    train: Train
    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    contact: FloatArray
    bearing_stiffness: FloatArray
    bearing_damping: FloatArray
    seat_shapes: FloatArray
    seat_residual: FloatArray
    inertia: FloatArray
    free: FloatArray

    @property
    def lateral(self) -> int:
        """Number of unknowns before the torsional ones."""
        return len(self.mass) - self.free.shape[1]

    def load(self, torque: FloatArray) -> FloatArray:
        """(n,) generalised force of external shaft torques (n_shaft,) N m along the running directions."""
        return np.concatenate([np.zeros(self.lateral), self.free.T @ torque])


def _point_rows(z: float, radius_vector: FloatArray) -> FloatArray:
    """(3, 5): displacement of a shaft point at `radius_vector` (x, y) off the axis, `z` from the centre of mass."""
    x, y = radius_vector
    # u + ψ × r with ψ = (ψx, ψy, 0), r = (x, y, z)
    return np.array([[1.0, 0, 0, 0, z], [0, 1.0, 0, -z, 0], [0, 0, 1.0, y, -x]])


def flank_normals(pinion_axis: FloatArray, wheel_axis: FloatArray, law: MeshLaw, rotation: int) -> FloatArray:
    """(2, 3) directions of the force on the wheel: drive flank, then back flank.

    rotation: +1 or −1, the pinion's sense about +z. The pinion's drive flank pushes the wheel tooth along its own
    motion t = rotation ẑ × e (e from pinion to wheel) and away along e. A right-handed tooth trace is t sin β + ẑ
    cos β on a gear that turns with +z, so its leading flank's normal leans to −ẑ: the driving right-handed pinion
    is thrust along +z when it turns with +z (right-hand rule). The back flank reverses the tangential and axial
    parts, never the radial one.
    """
    centre_line = np.append(wheel_axis - pinion_axis, 0.0)
    e = centre_line / np.linalg.norm(centre_line)
    t = rotation * np.cross([0.0, 0.0, 1.0], e)
    alpha, beta_b = law.working_pressure_angle, law.base_helix_angle
    along = np.cos(beta_b) * np.cos(alpha) * t - rotation * np.sin(beta_b) * np.array([0.0, 0.0, 1.0])
    apart = np.cos(beta_b) * np.sin(alpha) * e
    return np.array([along + apart, -along + apart])


def _check_law(gearbox: Gearbox, mesh: Mesh, law: MeshLaw) -> None:
    axes = [np.array(gearbox.shafts[gearbox.shaft_index(s)].axis) for s in (mesh.pinion_shaft, mesh.wheel_shaft)]
    distance = float(np.linalg.norm(axes[1] - axes[0]))
    where = f"mesh {mesh.pinion_shaft}–{mesh.wheel_shaft}"
    require(
        abs(distance - law.centre_distance) <= 1e-5,
        f"{where}: the shaft axes are {1e3 * distance:.4f} mm apart, but its mesh law is for "
        f"{1e3 * law.centre_distance:.4f} mm (limit 0.01 mm): move an axis or compute the law anew",
    )
    base = law.base_radius
    require(
        abs(base[0] * law.teeth[1] / (base[1] * law.teeth[0]) - 1.0) <= 1e-6,
        f"{where}: base radii {base[0]:g} and {base[1]:g} m do not stand in the ratio of the teeth {law.teeth}: "
        "correct the law",
    )
    cosine = float(base.sum()) / law.centre_distance
    require(
        abs(np.cos(law.working_pressure_angle) - cosine) <= 1e-4,
        f"{where}: working pressure angle {law.working_pressure_angle:g} rad does not fit base radii and centre "
        "distance "
        f"(cos = {cosine:.5f}): correct the law",
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


def _contact_rows(
    gearbox: Gearbox, kinematics: Train, laws: Sequence[MeshLaw], bodies: Sequence[RigidBody], size: int
) -> tuple[FloatArray, FloatArray]:
    """Contact rows on the lateral unknowns (2 n_mesh, size) and on the spins φ (2 n_mesh, n_shaft).

    The force acts at the pitch point at mid-width.
    """
    to_lateral = np.zeros((2 * len(laws), size))
    to_torsion = np.zeros((2 * len(laws), len(bodies)))
    for k, (mesh, law) in enumerate(zip(gearbox.meshes, laws, strict=True)):
        _check_law(gearbox, mesh, law)
        pair = [gearbox.shaft_index(mesh.pinion_shaft), gearbox.shaft_index(mesh.wheel_shaft)]
        axes = [np.array(gearbox.shafts[i].axis) for i in pair]
        normals = flank_normals(axes[0], axes[1], law, kinematics.rotation[pair[0]])
        pitch_point = axes[0] + (axes[1] - axes[0]) * law.teeth[0] / sum(law.teeth)
        for i, axis, sign, side in zip(pair, axes, (1.0, -1.0), (0, 1), strict=True):
            arm = pitch_point - axis
            rows = _point_rows(mesh.z - bodies[i].z, arm)
            # ψ_z × r, ψ_z = rotation · φ
            spin = kinematics.rotation[i] * np.array([-arm[1], arm[0], 0.0])
            for flank in (0, 1):
                # the flank is pressed when the pinion's point moves along the force on the wheel faster than the
                # wheel's
                to_lateral[2 * k + flank, 5 * i : 5 * i + 5] = sign * normals[flank] @ rows
                to_torsion[2 * k + flank, i] = sign * normals[flank] @ spin
            # law base radius and pitch geometry agree to the tolerance of _check_law; the law's is the definition
            lever = sign * law.base_radius[side] * np.cos(law.base_helix_angle)
            to_torsion[2 * k : 2 * k + 2, i] = lever, -lever
    return to_lateral, to_torsion


def _gyroscopic(
    gearbox: Gearbox, kinematics: Train, bodies: Sequence[RigidBody], input_speed: float, size: int
) -> FloatArray:
    """(size, size) forces per velocity: a shaft that spins at Ω about +z and tilts at ψ̇x, ψ̇y resists with
    J_p Ω ψ̇y about x and −J_p Ω ψ̇x about y (rate of change of its angular momentum J_p Ω (ψy, −ψx, 1))."""
    gyroscopic = np.zeros((size, size))
    for i, body in enumerate(bodies):
        momentum = body.polar_inertia * kinematics.rotation[i] * float(kinematics.speed_ratio[i]) * input_speed
        gyroscopic[5 * i + 3, 5 * i + 4], gyroscopic[5 * i + 4, 5 * i + 3] = momentum, -momentum
    return gyroscopic


def assemble(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], housing: ReducedHousing | None, *, input_speed: float = 0.0
) -> Assembly:
    """Put shafts, bearings, housing and lines of action together (module docstring; PHYSICS: series of bearing and
    seat).

    housing: None for rigid seats. The seats' residual flexibility R sits in series with the bearings:
    K_eff = (K_b⁻¹ + R)⁻¹, C_eff = K_eff K_b⁻¹ C_b K_b⁻¹ K_eff (first order in the damping of the exact complex
    series).
    input_speed: rad/s, for gyroscopic terms; 0 leaves them out.
    Raises InputError when bearings, seats, axes and laws do not fit together or a shaft can move freely.
    """
    require(
        len(mesh_laws) == len(gearbox.meshes),
        f"{len(mesh_laws)} mesh laws for {len(gearbox.meshes)} meshes: give one law per mesh, in the order of the "
        "meshes",
    )
    kinematics = train(gearbox, mesh_laws)
    bodies = [shaft.inertia() for shaft in gearbox.shafts]
    bearings = gearbox.bearings
    n_shaft, n_bearing = len(bodies), len(bearings)
    n_mode = 0 if housing is None else len(housing.natural_frequency)
    size = 5 * n_shaft + n_mode

    shapes = np.zeros((3 * n_bearing, n_mode))
    residual = np.zeros((3 * n_bearing, 3 * n_bearing))
    modal_stiffness = modal_damping = np.zeros(0)
    if housing is not None:
        seats = _seats(bearings, gearbox, housing)
        require(
            n_mode == 0 or housing.natural_frequency[0] > 0,
            "the housing has a rigid-body mode (0 Hz): fix it at its bolts before it goes into the gearbox",
        )
        shapes = housing.seat_shapes[:, seats].reshape(n_mode, 3 * n_bearing).T
        residual = housing.seat_residual[seats][:, :, seats].reshape(3 * n_bearing, -1)
        residual = 0.5 * (residual + residual.T)
        omega = 2.0 * np.pi * housing.natural_frequency
        modal_stiffness, modal_damping = omega**2, 2.0 * housing.modal_damping * omega

    bearing_map = np.zeros((3 * n_bearing, size))
    for j, bearing in enumerate(bearings):
        i = gearbox.shaft_index(bearing.shaft)
        bearing_map[3 * j : 3 * j + 3, 5 * i : 5 * i + 5] = _point_rows(bearing.z - bodies[i].z, np.zeros(2))
    bearing_map[:, 5 * n_shaft :] = -shapes

    k_b = np.array([k for b in bearings for k in (b.radial_stiffness, b.radial_stiffness, b.axial_stiffness)])
    c_b = np.array([c for b in bearings for c in (b.radial_damping, b.radial_damping, b.axial_damping)])
    k_eff = np.linalg.inv(np.diag(1.0 / k_b) + residual)
    k_eff = 0.5 * (k_eff + k_eff.T)
    c_eff = (k_eff / k_b) @ np.diag(c_b) @ (k_eff / k_b).T
    require(
        float(np.linalg.eigvalsh(k_eff)[0]) > 0,
        "the housing's seat residual is so negative that bearing and seat in series are unstable: add housing modes",
    )

    mass = np.concatenate(
        [[b.mass, b.mass, b.mass, b.transverse_inertia, b.transverse_inertia] for b in bodies] + [np.ones(n_mode)]
    )
    require(bool((mass > 0).all()), "a shaft has no transverse inertia: give its segments or bodies one")
    diagonal = np.concatenate([np.zeros(5 * n_shaft), modal_stiffness])
    stiffness = np.diag(diagonal) + bearing_map.T @ k_eff @ bearing_map
    damping = np.diag(np.concatenate([np.zeros(5 * n_shaft), modal_damping])) + bearing_map.T @ c_eff @ bearing_map
    damping += _gyroscopic(gearbox, kinematics, bodies, input_speed, size)
    scaled = stiffness / np.sqrt(np.outer(mass, mass))
    lowest, *_, highest = np.linalg.eigvalsh(scaled)
    if lowest <= 1e-12 * highest:
        raise InputError(
            "a shaft can move freely on its bearings: give every shaft two bearings that also hold it along z"
        )

    inertia = np.array(
        [body.polar_inertia + shaft.coupled_inertia for body, shaft in zip(bodies, gearbox.shafts, strict=True)]
    )
    # common spin r: φ = speed ratios. N with rᵀJN = 0 and NᵀJN = I, so J^½ N is orthonormal and normal to J^½ r.
    root = np.sqrt(inertia)
    common = root * np.array([float(ratio) for ratio in kinematics.speed_ratio])
    free = null_space(common[None, :]) / root[:, None]
    n_torsion = n_shaft - 1
    to_lateral, to_torsion = _contact_rows(gearbox, kinematics, mesh_laws, bodies, size)

    def widened(rows: FloatArray) -> FloatArray:
        return np.hstack([rows, np.zeros((len(rows), n_torsion))])

    return Assembly(
        gearbox=gearbox,
        train=kinematics,
        mass=np.concatenate([mass, np.ones(n_torsion)]),
        stiffness=np.pad(stiffness, (0, n_torsion)),
        damping=np.pad(damping, (0, n_torsion)),
        contact=np.hstack([to_lateral, to_torsion @ free]),
        bearing_stiffness=widened(k_eff @ bearing_map),
        bearing_damping=widened(c_eff @ bearing_map),
        seat_shapes=shapes,
        seat_residual=residual,
        inertia=inertia,
        free=free,
    )
