"""Cross-sections of the shafts: how they move with the unknowns, and what a force on them does to these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nvhchain.dynamics.model.gearbox import RigidBody, Shaft
from nvhchain.dynamics.model.shaft_beam import ElasticShaft, elastic_shaft
from nvhchain.handoff import FloatArray


@dataclass(frozen=True, eq=False)
class Wrench:
    """A force on the cross-section of a shaft.

    shaft: index.  z: m, of the cross-section.  load: (6,) force along x, y, z and moment about the shaft's axis there.
    """

    shaft: int
    z: float
    load: FloatArray


@dataclass(frozen=True, eq=False)
class Sections:
    """Motion of all cross-sections by the unknowns: five rigid ones per shaft (translations of its centre of mass,
    tilts), after `first` the elastic ones, shaft by shaft, and the spins φ, each along its shaft's running direction.

    bodies: the shafts as rigid bodies.  elastic: None for rigid shafts.  rotation (n_shaft,): +1 or −1 about +z.
    """

    bodies: tuple[RigidBody, ...]
    elastic: tuple[ElasticShaft, ...] | None
    rotation: tuple[int, ...]
    first: int

    @property
    def size(self) -> int:
        """Number of unknowns without the spins, what lies between the rigid and the elastic ones included."""
        return self.first + sum(len(shaft.squared) for shaft in self.elastic or ())

    def columns(self, shaft: int) -> np.ndarray:
        """Indices of a shaft's rigid unknowns, then of its elastic ones."""
        rigid = np.arange(5 * shaft, 5 * shaft + 5)
        if self.elastic is None:
            return rigid
        begin = self.first + sum(len(other.squared) for other in self.elastic[:shaft])
        return np.concatenate([rigid, np.arange(begin, begin + len(self.elastic[shaft].squared))])

    def rows(self, wrenches: Sequence[Wrench]) -> tuple[FloatArray, FloatArray]:
        """Generalised force of `wrenches` together: on the unknowns (size,) and on the spins (n_shaft,)."""
        on_unknowns, on_spins = np.zeros(self.size), np.zeros(len(self.bodies))
        for wrench in wrenches:
            i, (fx, fy, fz, mx, my, mz) = wrench.shaft, wrench.load
            arm = wrench.z - self.bodies[i].z
            # u + ψ × r with ψ = (ψx, ψy, 0)
            share = np.array([fx, fy, fz, mx - arm * fy, my + arm * fx])
            if self.elastic is not None:
                share = np.concatenate([share, wrench.load @ self.elastic[i].at(wrench.z)])
            on_unknowns[self.columns(i)] += share
            on_spins[i] += self.rotation[i] * mz
        return on_unknowns, on_spins

    def gyroscopic(self, speed: FloatArray) -> FloatArray:
        """(size, size) forces per velocity of shafts that spin at `speed` (n_shaft,) rad/s about +z.

        Where a rigid shaft tilts at ψ̇x, ψ̇y it resists with J_p Ω ψ̇y about x and −J_p Ω ψ̇x about y (rate of change of
        its angular momentum J_p Ω (ψy, −ψx, 1)).
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
    """The shafts, flexible under the loads that can act on them (`acting`) where `element` (m) and `frequency` (Hz) of
    `elastic_shaft` are given, rigid where not."""
    bodies = tuple(shaft.inertia() for shaft in shafts)
    elastic = None
    if element > 0.0:
        elastic = tuple(
            elastic_shaft(shaft, [(w.z, w.load) for w in acting if w.shaft == i], element=element, frequency=frequency)
            for i, shaft in enumerate(shafts)
        )
    return Sections(bodies, elastic, rotation, first)
