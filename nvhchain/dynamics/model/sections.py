"""Cross-sections of the shafts: their motion by the unknowns, and the generalised forces of loads on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.dynamics.model.shaft_beam import ElasticShaft, elastic_shaft
from nvhchain.dynamics.model.shafts import RigidBody, Shaft
from nvhchain.handoff import FloatArray


@dataclass(frozen=True, eq=False)
class Wrench:
    """Force and moment on the cross-section of a shaft.

    shaft : index of the shaft.
    z : position of the cross-section (m).
    load : (6,) force along x, y, z and moment about the shaft's axis there.
    rotor : index of the loose gear on which it acts, which takes the moment about the axis; −1 for the shaft itself.
    """

    shaft: int
    z: float
    load: FloatArray
    rotor: int = -1

    @property
    def shaft_load(self) -> FloatArray:
        """Part (6,) of the load that the shaft takes."""
        return self.load if self.rotor < 0 else self.load * [1.0, 1.0, 1.0, 1.0, 1.0, 0.0]


@dataclass(frozen=True, eq=False)
class Sections:
    """Motion of all cross-sections by the unknowns.

    The unknowns are five rigid ones per shaft (translations of its centre of mass, tilts). The elastic ones follow from
    index `first` on, shaft by shaft. Last come the spins φ of shafts and loose gears, each along its running direction.

    bodies : the shafts as rigid bodies.
    elastic : elastic motions per shaft; None for rigid shafts.
    rotation : (n_rotor,) sense of rotation about +z, +1 or −1.
    """

    bodies: tuple[RigidBody, ...]
    elastic: tuple[ElasticShaft, ...] | None
    rotation: tuple[int, ...]
    first: int

    @property
    def size(self) -> int:
        """Number of unknowns without the spins, including those between the rigid and the elastic ones."""
        return self.first + sum(len(shaft.squared) for shaft in self.elastic or ())

    def columns(self, shaft: int) -> np.ndarray:
        """Return the indices of a shaft's rigid unknowns, then of its elastic ones."""
        rigid = np.arange(5 * shaft, 5 * shaft + 5)
        if self.elastic is None:
            return rigid
        begin = self.first + sum(len(other.squared) for other in self.elastic[:shaft])
        return np.concatenate([rigid, np.arange(begin, begin + len(self.elastic[shaft].squared))])

    def rows(self, wrenches: Sequence[Wrench]) -> tuple[FloatArray, FloatArray]:
        """Return the generalised force of all `wrenches`: on the unknowns (size,) and on the spins (n_rotor,)."""
        force, torque = np.zeros(self.size), np.zeros(len(self.rotation))
        for wrench in wrenches:
            i, (fx, fy, fz, mx, my, mz) = wrench.shaft, wrench.load
            arm = wrench.z - self.bodies[i].z
            # u + ψ × r with ψ = (ψx, ψy, 0)
            share = np.array([fx, fy, fz, mx - arm * fy, my + arm * fx])
            if self.elastic is not None:
                share = np.concatenate([share, wrench.shaft_load @ self.elastic[i].motion_at(wrench.z)])
            force[self.columns(i)] += share
            rotor = i if wrench.rotor < 0 else wrench.rotor
            torque[rotor] += self.rotation[rotor] * mz
        return force, torque

    def gyroscopic(self, speed: FloatArray) -> FloatArray:
        """Return the forces (size, size) per velocity of shafts that spin at `speed` (n_shaft,) (rad/s about +z).

        A rigid shaft that tilts at ψ̇x, ψ̇y resists with J_p Ω ψ̇y about x and −J_p Ω ψ̇x about y. This is the rate of
        change of its angular momentum J_p Ω (ψy, −ψx, 1).
        """
        total = np.zeros((self.size, self.size))
        for i, (body, omega) in enumerate(zip(self.bodies, speed, strict=True)):
            if self.elastic is not None:
                total[np.ix_(self.columns(i), self.columns(i))] = omega * self.elastic[i].gyroscopic
            else:
                momentum = body.polar_inertia * omega
                total[5 * i + 3, 5 * i + 4], total[5 * i + 4, 5 * i + 3] = momentum, -momentum
        return total


def sections(
    shafts: Sequence[Shaft],
    rotation: tuple[int, ...],
    first: int,
    acting: Sequence[Wrench],
    *,
    element: float = 0.0,
    frequency: float = 0.0,
) -> Sections:
    """Return the cross-sections of the shafts, flexible where `element` is above 0.

    acting : all wrenches that can act on the shafts.
    element, frequency : largest element (m) and highest mode (Hz) of `elastic_shaft`; element 0 gives rigid shafts.
    """
    bodies = tuple(shaft.inertia() for shaft in shafts)
    elastic = None
    if element > 0.0:
        elastic = tuple(
            elastic_shaft(
                shaft, [(w.z, w.shaft_load) for w in acting if w.shaft == i], element=element, frequency=frequency
            )
            for i, shaft in enumerate(shafts)
        )
    return Sections(bodies, elastic, rotation, first)
