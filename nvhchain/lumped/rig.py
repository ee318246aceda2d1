"""Torsional test rig: test pair and reaction pair, closed into a ring by two shafts (thesis, ch. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.linalg import eigh

from nvhchain.errors import require
from nvhchain.handoff import ComplexArray, FloatArray
from nvhchain.kinds import check_fields, checked


@dataclass(frozen=True)
class TorsionalRig:
    """Four inertias in a ring: test mesh 1–2, shaft 2–4, reaction mesh 4–3, shaft 3–1.

    inertias: inertias (kg m²) of test gears 1, 2 and reaction gears 3, 4.
    test_mesh, reaction_mesh: torsional stiffness of the meshes (Nm/rad).
    shaft_13, shaft_24: torsional stiffness of the shafts (Nm/rad).
    damping_ratio: damping ratio of every elastic mode, 0 … 1.

    Raises InputError if a value is not finite or outside its range.

    Rotations are positive in the running direction of their shaft.  Both meshes have the ratio 1.
    """

    inertias: tuple[float, float, float, float]
    test_mesh: float
    reaction_mesh: float
    shaft_13: float
    shaft_24: float
    damping_ratio: float

    def __post_init__(self) -> None:
        check_fields(self)
        positive = {
            **{f"inertias[{i}]": value for i, value in enumerate(self.inertias)},
            "test_mesh": self.test_mesh,
            "reaction_mesh": self.reaction_mesh,
            "shaft_13": self.shaft_13,
            "shaft_24": self.shaft_24,
        }
        require(len(self.inertias) == 4, f"rig inertias = {self.inertias}: four are needed")
        for name, value in positive.items():
            require(isfinite(value) and value > 0, f"rig {name} = {value} must be positive and finite")
        require(0 <= self.damping_ratio < 1, f"rig damping_ratio = {self.damping_ratio} is outside 0…1")

    @property
    def inertia_matrix(self) -> FloatArray:
        """Inertia matrix (4, 4), kg m²."""
        return np.diag(np.array(self.inertias))

    @property
    def stiffness_matrix(self) -> FloatArray:
        """Stiffness matrix (4, 4), Nm/rad."""
        springs = np.array([self.test_mesh, self.reaction_mesh, self.shaft_13, self.shaft_24])
        return np.asarray(TWISTS.T @ (springs[:, None] * TWISTS))


TWISTS = np.array([[1.0, -1, 0, 0], [0, 0, 1, -1], [1, 0, -1, 0], [0, 1, 0, -1]])
"""Matrix from the four rotations to the twists of test mesh, reaction mesh, shaft 1–3 and shaft 2–4."""

FITTED_RIG = TorsionalRig((0.0218, 0.0118, 0.2, 0.2), 1.1444e6, 1.8020e6, 4.806e4, 4.806e4, 0.05)
"""Rig of the thesis, its stiffnesses fitted to the modes at 280, 680 and 1968 Hz. The printed k12 = 1.6e6 gives 2319
Hz."""


@dataclass(frozen=True, eq=False)
class RigModes:
    """Elastic modes of a rig; the rotation of the whole ring is excluded.

    frequency (3,): natural frequencies (Hz).
    shapes (4, 3): mass-normalised mode shapes (kg^-1/2 m^-1).
    twist (4, 3): twists of test mesh, reaction mesh, shaft 1–3 and shaft 2–4 in each mode.
    energy (4, 3): shares of the same four springs in the strain energy.
    """

    frequency: FloatArray
    shapes: FloatArray
    twist: FloatArray
    energy: FloatArray


@checked
def rig_modes(rig: TorsionalRig) -> RigModes:
    """Return the natural modes without damping."""
    squared, shapes = eigh(rig.stiffness_matrix, rig.inertia_matrix)
    shapes, squared = shapes[:, 1:], squared[1:]
    twist = TWISTS @ shapes
    springs = np.array([rig.test_mesh, rig.reaction_mesh, rig.shaft_13, rig.shaft_24])
    energy = springs[:, None] * twist**2
    return RigModes(np.sqrt(squared) / (2.0 * np.pi), shapes, twist, energy / energy.sum(axis=0))


@checked
def mesh_cross_response(rig: TorsionalRig, frequency: FloatArray, *, mesh: str, due_to: str) -> ComplexArray:
    """Return the twist of one mesh per torque that opens a mesh: sum over the elastic modes, under e^{+jωt}.

    Parameters
    ----------
    rig : TorsionalRig
        Test rig.
    frequency : (n_f,) array
        Frequencies (Hz).
    mesh : {'test', 'reaction'}
        Mesh at which the twist is taken.
    due_to : {'test', 'reaction'}
        Mesh that the torque opens.

    Returns
    -------
    (n_f,) complex array
        Response (rad/Nm).

    Raises
    ------
    InputError
        If a mesh is unknown or the frequencies are not one row of finite numbers.

    Notes
    -----
    The opposite torques of a mesh do not turn the ring as a whole, so the response stays finite at 0 Hz. Multiplied by
    the square of the base radius, which is equal at both meshes, it is the transmission error per mesh force (m/N).
    """
    for name, value in (("at", mesh), ("due_to", due_to)):
        require(value in MESHES, f"{name} = {value!r}: choose from {', '.join(MESHES)}")
    frequency = np.asarray(frequency, dtype=float)
    require(
        frequency.ndim == 1 and bool(np.isfinite(frequency).all()),
        f"frequencies of shape {frequency.shape} must be one row of finite numbers",
    )
    modes = rig_modes(rig)
    natural = 2.0 * np.pi * modes.frequency
    omega = 2.0 * np.pi * frequency[:, None]
    participation = modes.twist[MESHES.index(mesh)] * modes.twist[MESHES.index(due_to)]
    modal = natural**2 - omega**2 + 2j * rig.damping_ratio * natural * omega
    return np.asarray((participation / modal).sum(axis=1))


MESHES = ("test", "reaction")
"""Names of the two meshes of the ring."""
