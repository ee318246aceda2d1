"""A small one-shaft casting, meshed and reduced once for the tests."""

from dataclasses import replace

import numpy as np
import pytest

from nvhchain.fem import lowest_modes
from nvhchain.fem.modal_model import ModalModel
from nvhchain.fidelity import HousingFidelity
from nvhchain.housing import Bore, Casting, GearSpace
from nvhchain.housing.casting.mesh import boundary_faces, mesh_casting, mounting_plane_faces, radiating_surface
from nvhchain.housing.reduction import held_matrices, reduce_mesh
from nvhchain.housing.skin.normal_motion import normal_motion


@pytest.fixture(scope="session")
def casting():
    return Casting(
        bores=(Bore("A1", (0.0, 0.0, 0.039), 0.02), Bore("A2", (0.0, 0.0, 0.149), 0.02)),
        gear_spaces=(GearSpace((0.0, 0.0), 0.05), GearSpace((0.05, 0.01), 0.06)),
        wall=0.0055,
        end_wall=0.006,
        depth=0.15,
        bell_depth=0.036,
        bolts=4,
        side_ribs=0,
        spokes=3,
        modal_damping=0.015,
    )


@pytest.fixture(scope="session")
def fidelity():
    """Frequencies as the elements have them, so that they may be compared with other solutions of the same elements."""
    return HousingFidelity(
        element_size=0.03,
        mode_ratio=1.4,
        elements_per_turn=6.0,
        elements_per_bending_wavelength=3.0,
        corrected_frequencies=False,
    )


@pytest.fixture(scope="session")
def mesh(casting, fidelity):
    return mesh_casting(casting, fidelity)


@pytest.fixture(scope="session")
def surface(casting):
    return radiating_surface(casting, 0.022)


@pytest.fixture(scope="session")
def motion(mesh, surface, fidelity):
    return normal_motion(mesh.nodes, mesh.skin, surface, mounting_plane_faces(surface), fidelity.samples_per_face)


F_MAX = 4000.0
"""Hz, band of the reduced test housing."""


@pytest.fixture(scope="session")
def reduced(mesh, casting, surface, motion, fidelity):
    return reduce_mesh(mesh, casting, surface, lambda: motion, F_MAX, fidelity)


@pytest.fixture(scope="session")
def rich(mesh, casting, surface, motion, fidelity):
    """The same housing with modes to 3.5 times the band: what it says below F_MAX is true within 1e-5."""
    return reduce_mesh(mesh, casting, surface, lambda: motion, F_MAX, replace(fidelity, mode_ratio=3.5))


@pytest.fixture(scope="session")
def modes(mesh, casting, reduced):
    """The casting's modes at all nodes and at two more in the middle of the seats."""
    K, M, T = held_matrices(mesh, casting)
    frequency, shapes = lowest_modes(K, M, reduced.natural_frequency[-1] * 1.001)
    at_nodes = (T @ shapes).T.reshape(len(frequency), -1, 3)
    unknowns = K.shape[0] - 6 * np.array([2, 1])
    at_seats = shapes[unknowns[:, None] + np.arange(3)].transpose(2, 0, 1)
    return ModalModel(
        nodes=np.vstack([mesh.nodes, [bore.centre for bore in casting.bores]]),
        labels=np.arange(1, len(mesh.nodes) + 3),
        triangles=boundary_faces(mesh.elements)[:, :3],
        two_sided=False,
        frequency=frequency,
        damping=np.full(len(frequency), casting.modal_damping),
        shapes=np.concatenate([at_nodes, at_seats], axis=1),
    )
