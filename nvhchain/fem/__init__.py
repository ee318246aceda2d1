"""Finite elements shared by gear bodies and housing: matrices, constraints, sparse and eigen solvers."""

from typing import TYPE_CHECKING

from nvhchain.runtime.deferred import deferred

if TYPE_CHECKING:
    from nvhchain.fem._sparse import Factor, check_unknowns, factorize
    from nvhchain.fem.constraints import rigid_map
    from nvhchain.fem.eigen import RitzVectors, lowest_modes, modes_and_ritz_vectors
    from nvhchain.fem.elasticity import stiffness_and_mass
    from nvhchain.fem.mesh_error import frequency_errors, inner_edges
else:
    __getattr__, __dir__ = deferred(__name__, __file__)

__all__: list[str] = []
