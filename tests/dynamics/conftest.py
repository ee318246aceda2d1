"""The two-stage gearbox of plain numbers, and forces on it in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from nvhchain.dynamics import Gearbox
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import MeshLaw, ReducedHousing
from nvhchain.testing import two_stages


@pytest.fixture(scope="session")
def make_law() -> Callable[..., MeshLaw]:
    return two_stages.law


@pytest.fixture(scope="session")
def make_laws() -> Callable[..., tuple[MeshLaw, MeshLaw]]:
    return two_stages.laws


@pytest.fixture(scope="session")
def make_gearbox() -> Callable[..., Gearbox]:
    return two_stages.gearbox


@pytest.fixture(scope="session")
def make_housing() -> Callable[..., ReducedHousing]:
    return two_stages.housing


@pytest.fixture
def fidelity() -> DynamicsFidelity:
    return DynamicsFidelity(time_step=10e-6)


@pytest.fixture(scope="session")
def forced_bearing_forces() -> Callable[..., np.ndarray]:
    """(3 n_bearing,) complex N under a harmonic generalised force (n,), drive flanks closed, by the impedance."""

    def of(assembly, mesh_stiffness, omega, push):
        drive = assembly.contact[0 : 2 * len(mesh_stiffness) : 2]
        stiffness = assembly.stiffness + (drive.T * np.array(mesh_stiffness)) @ drive
        dynamic = stiffness + 1j * omega * assembly.damping - omega**2 * np.diag(assembly.mass)
        return (assembly.bearing_stiffness + 1j * omega * assembly.bearing_damping) @ np.linalg.solve(dynamic, push)

    return of


@pytest.fixture(scope="session")
def nominal_mesh_forces() -> Callable[..., np.ndarray]:
    """(n_mesh,) N along the drive flanks' normals under shaft torques (n_shaft,), from the balance in torsion."""

    def of(assembly, torque):
        drive = assembly.contact[0 : 2 * len(assembly.gearbox.meshes) : 2]
        return np.linalg.solve(drive[:, assembly.lateral :].T, assembly.load(torque)[assembly.lateral :])

    return of
