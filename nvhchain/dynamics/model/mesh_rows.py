"""Lines of action: forces of the meshes on the shafts.

A mesh carries at one point of its face width or at several. Each point has two contacts: first its drive flank, then
its back flank.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.legendre import leggauss

from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.dynamics.model.parts import Mesh
from nvhchain.dynamics.model.sections import Wrench
from nvhchain.dynamics.model.train import Train
from nvhchain.errors import require
from nvhchain.handoff import FloatArray, IntArray, MeshLaw

LARGEST_SHIFT = 0.1e-3
"""Largest difference (m) of the centre distance of a mesh law and that of its shafts: the tolerance of its bores."""


@dataclass(frozen=True, eq=False)
class End:
    """Gear of a mesh.

    shaft : index of the shaft that carries it.
    rotor : index of what turns with it: the shaft, or the gear itself where it is loose.
    axis : (2,) position x, y of the axis (m).
    turn : sense of rotation about +z, +1 or −1.
    """

    shaft: int
    rotor: int
    axis: FloatArray
    turn: int

    def wrench(self, z: float, load: FloatArray) -> Wrench:
        """Return a wrench on the gear: `load` (6,) at z (m)."""
        return Wrench(self.shaft, z, load, -1 if self.rotor == self.shaft else self.rotor)


def ends(gearbox: Gearbox, kinematics: Train, mesh: Mesh) -> tuple[End, End]:
    """Return pinion and wheel of a mesh."""

    def end(name: str) -> End:
        shaft, rotor = gearbox.shaft_index(name), gearbox.rotor_index(name)
        return End(shaft, rotor, np.array(gearbox.shafts[shaft].axis), kinematics.rotation[rotor])

    return end(mesh.pinion_shaft), end(mesh.wheel_shaft)


def flank_normals(pinion_axis: FloatArray, wheel_axis: FloatArray, law: MeshLaw, rotation: int) -> FloatArray:
    """Return the directions (2, 3) of the force on the wheel: drive flank, then back flank.

    rotation : sense of the pinion about +z, +1 or −1.

    The pinion's drive flank pushes the wheel tooth along its own motion t = rotation ẑ × e (e from pinion to wheel) and
    away along e. A right-handed tooth trace is t sin β + ẑ cos β on a gear that turns with +z. Its leading flank's
    normal therefore leans to −ẑ. The driving right-handed pinion is thrust along +z when it turns with +z (right-hand
    rule). The back flank reverses the tangential and axial parts, never the radial one.
    """
    centre_line = np.append(wheel_axis - pinion_axis, 0.0)
    e = centre_line / np.linalg.norm(centre_line)
    t = rotation * np.cross([0.0, 0.0, 1.0], e)
    alpha, beta_b = law.working_pressure_angle, law.base_helix_angle
    tangential = np.cos(beta_b) * np.cos(alpha) * t - rotation * np.sin(beta_b) * np.array([0.0, 0.0, 1.0])
    apart = np.cos(beta_b) * np.sin(alpha) * e
    return np.array([tangential + apart, -tangential + apart])


def check_law(gearbox: Gearbox, mesh: Mesh, law: MeshLaw) -> None:
    """Raise InputError if the law does not belong to the mesh."""
    axes = [np.array(gearbox.shafts[gearbox.shaft_index(s)].axis) for s in (mesh.pinion_shaft, mesh.wheel_shaft)]
    distance = float(np.linalg.norm(axes[1] - axes[0]))
    where = f"mesh {mesh.pinion_shaft}–{mesh.wheel_shaft}"
    require(
        abs(distance - law.centre_distance) <= LARGEST_SHIFT,
        f"{where}: the shaft axes are {1e3 * distance:.4f} mm apart, but its mesh law is for "
        f"{1e3 * law.centre_distance:.4f} mm (limit {1e3 * LARGEST_SHIFT:g} mm): move an axis or compute the law anew",
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


def face_points(count: int) -> tuple[FloatArray, FloatArray]:
    """Return places on the face (−½ … ½ of its width) and force shares of `count` Gauss points.

    Two points give independent slices of equal stiffness their exact resistance to tilt.
    """
    node, weight = leggauss(count)
    return 0.5 * node, 0.5 * weight


def contact_wrenches(
    gearbox: Gearbox, kinematics: Train, mesh: Mesh, law: MeshLaw, offset: float
) -> list[list[Wrench]]:
    """Return the wrenches on pinion and wheel whose work is the deflection: of the drive flank, then of the back flank.

    offset : distance of the point from mid-width along z (m).

    The force acts at the pitch point at this offset. The rigid gear transmits it to its shaft at mid-width.
    """
    pair = ends(gearbox, kinematics, mesh)
    normals = flank_normals(pair[0].axis, pair[1].axis, law, pair[0].turn)
    pitch_point = pair[0].axis + (pair[1].axis - pair[0].axis) * law.teeth[0] / sum(law.teeth)
    wrenches: list[list[Wrench]] = [[], []]
    for side, (end, sign) in enumerate(zip(pair, (1.0, -1.0), strict=True)):
        for flank, way in ((0, 1.0), (1, -1.0)):
            # the pinion's point presses the flank where it moves faster along the force on the wheel than the wheel's
            force = sign * normals[flank]
            moment = np.cross(np.append(pitch_point - end.axis, offset), force)
            # the law's base radius is the definition; the pitch geometry agrees within the tolerance of check_law
            lever = sign * way * law.base_radius[side] * np.cos(law.base_helix_angle)
            moment[2] = end.turn * lever
            wrenches[flank].append(end.wrench(mesh.z, np.concatenate([force, moment])))
    return wrenches


def friction_wrenches(gearbox: Gearbox, kinematics: Train, mesh: Mesh, law: MeshLaw) -> list[list[Wrench]]:
    """Return the wrenches of unit A and of unit S / r_bP (`nvhchain.dynamics.model.angle_laws`).

    They are subtracted like a contact force.
    """
    pair = ends(gearbox, kinematics, mesh)
    turn = [end.turn for end in pair]
    normal = flank_normals(pair[0].axis, pair[1].axis, law, turn[0])[0]
    transverse = np.array([normal[0], normal[1], 0.0]) / np.hypot(normal[0], normal[1])
    slide_direction = turn[0] * np.cross([0.0, 0.0, 1.0], transverse)
    line = float(law.base_radius.sum()) * np.tan(law.working_pressure_angle)
    slide = [
        pair[0].wrench(mesh.z, np.concatenate([slide_direction, np.zeros(3)])),
        pair[1].wrench(mesh.z, np.concatenate([-slide_direction, [0.0, 0.0, -turn[1] * line]])),
    ]
    arm = [end.wrench(mesh.z, np.array([0.0, 0.0, 0.0, 0.0, 0.0, end.turn * law.base_radius[0]])) for end in pair]
    return [slide, arm]


def shuttling_wrenches(gearbox: Gearbox, kinematics: Train, mesh: Mesh, law: MeshLaw) -> list[Wrench]:
    """Return the wrenches of unit F ζ / b (`nvhchain.dynamics.model.angle_laws`), subtracted like a contact force."""
    middle, edge = (contact_wrenches(gearbox, kinematics, mesh, law, offset)[0] for offset in (0.0, law.face_width))
    return [replace(a, load=b.load - a.load) for a, b in zip(middle, edge, strict=True)]


def tilt_wrenches(gearbox: Gearbox, kinematics: Train, mesh: Mesh, law: MeshLaw) -> list[list[Wrench]]:
    """Return the wrenches whose work is the tilt (rad) of the wheel's axis against the pinion's, in two planes.

    The first tilt lies in the plane of action of the drive flanks, > 0 where it closes them towards +z. The second lies
    across it, > 0 where the wheel leaves the pinion towards +z.
    """
    pair = ends(gearbox, kinematics, mesh)
    transverse = flank_normals(pair[0].axis, pair[1].axis, law, pair[0].turn)[0] * [1.0, 1.0, 0.0]
    transverse /= np.linalg.norm(transverse)
    away = np.cross([0.0, 0.0, 1.0], transverse)
    away *= np.sign(away[:2] @ (pair[1].axis - pair[0].axis))
    # a shaft tilted by ψ moves by ψ × ẑ per length: along −`transverse` it closes the flanks, along `away` it leaves
    moments = [np.cross([0.0, 0.0, 1.0], direction) for direction in (-transverse, away)]
    return [
        [
            end.wrench(mesh.z, np.concatenate([np.zeros(3), side * m]))
            for end, side in zip(pair, (-1.0, 1.0), strict=True)
        ]
        for m in moments
    ]


def error_wrenches(gearbox: Gearbox, kinematics: Train, mesh: Mesh, law: MeshLaw) -> list[Wrench]:
    """Return the wrenches whose work is the transmission error r_bP φ_P − r_bG φ_G (m), with φ at the gears."""
    return [
        end.wrench(mesh.z, np.array([0.0, 0.0, 0.0, 0.0, 0.0, side * end.turn * radius]))
        for end, side, radius in zip(ends(gearbox, kinematics, mesh), (1.0, -1.0), law.base_radius, strict=True)
    ]


def all_wrenches(
    gearbox: Gearbox, kinematics: Train, laws: Sequence[MeshLaw], points: int
) -> tuple[list[list[Wrench]], IntArray, FloatArray, FloatArray]:
    """Return the wrenches of all contact rows; mesh index, force share and offset (m) of every pair of rows.

    The points of all meshes come first. Rows that depend on the angle only follow, with share 0: for each mesh two
    pairs for friction and one for shuttling, where it has them.
    """
    rows: list[list[Wrench]] = []
    meshes, shares, places = [], [], []
    place, weight = face_points(points)
    for k, (mesh, law) in enumerate(zip(gearbox.meshes, laws, strict=True)):
        check_law(gearbox, mesh, law)
        known = (ratio for ratio in (mesh.tilt_ratio, law.tilt_ratio) if ratio is not None)
        offsets = place * law.face_width * np.sqrt(next(known, 1.0))
        for offset, share in zip(offsets, weight, strict=True):
            rows += contact_wrenches(gearbox, kinematics, mesh, law, offset)
            meshes.append(k)
            shares.append(share)
            places.append(offset)
    for k, (mesh, law) in enumerate(zip(gearbox.meshes, laws, strict=True)):
        channels = friction_wrenches(gearbox, kinematics, mesh, law) if mesh.friction is not None else []
        if mesh.load_centre is not None:
            channels.append(shuttling_wrenches(gearbox, kinematics, mesh, law))
        for channel in channels:
            rows += [channel, [replace(w, load=-w.load) for w in channel]]
            meshes.append(k)
            shares.append(0.0)
            places.append(0.0)
    return rows, np.array(meshes, dtype=np.int64), np.array(shares), np.array(places)
