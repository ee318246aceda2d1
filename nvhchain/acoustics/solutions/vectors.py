"""Acoustic transfer vectors by the adjoint: one system per frequency, one right-hand side per field point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nvhchain.acoustics.radiation.rayleigh import rayleigh_vectors
from nvhchain.acoustics.solutions.quantity import Line, Quantity
from nvhchain.acoustics.surfaces.velocity_slopes import velocity_within_faces
from nvhchain.acoustics.systems.engines import vectors_memory
from nvhchain.acoustics.systems.frequency_blocks import Solved
from nvhchain.acoustics.systems.linear_system import System
from nvhchain.acoustics.waves.layer_potentials import layer_potentials
from nvhchain.conventions import Air
from nvhchain.handoff import ComplexArray, FloatArray, SolverRecord, Surface


@dataclass(frozen=True, eq=False)
class Vectors(Quantity):
    """Transfer vectors (n_end, n_face), −jωρ (Bᵀ A⁻ᵀ d − s): p(x) = d·p − s·∂p/∂n at every end x.

    ends : (n_end, 3) field points and, with a plane, their images (m).
    cut_ratio : near-field limit of `layer_potentials`.
    """

    step = "transfer_vectors"

    surface: Surface
    ends: FloatArray
    air: Air
    cut_ratio: float

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values at one frequency."""
        return len(self.ends), len(self.surface.triangles)

    def memory(self, frequencies: int) -> tuple[int, int]:
        """Return the bytes of all results, and of the columns of one block."""
        return vectors_memory(len(self.surface.vertices), len(self.surface.triangles), len(self.ends), frequencies)

    def values(self, system: System, line: Line, *row: ComplexArray) -> ComplexArray:
        """Return the vectors at one frequency."""
        double, single = layer_potentials(self.surface, self.ends, line.wavenumber, self.cut_ratio)
        of_faces = system.adjoint(double.T).T
        of_faces -= single
        return np.asarray(-1j * line.omega * self.air.density * (of_faces @ velocity_within_faces(self.surface)))

    def rayleigh(self, frequency: FloatArray) -> Solved:
        """Return the vectors by the Rayleigh integral."""
        vectors = rayleigh_vectors(frequency, self.surface, self.ends, self.air, self.cut_ratio)
        return Solved(vectors, SolverRecord())
