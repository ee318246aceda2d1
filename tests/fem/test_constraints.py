"""Rigid sets move as rigid bodies."""

import numpy as np
import pytest

from nvhchain.errors import InputError
from nvhchain.fem import rigid_map
from nvhchain.testing import elements as meshes

NODES = np.random.default_rng(2).uniform(-1, 1, (20, 3))


def test_constraint_map_reproduces_every_rigid_motion():
    reference = np.array([0.3, -0.2, 0.7])
    members = np.array([4, 7, 9, 12])
    T = rigid_map(NODES, [(members, reference)])
    free = np.setdiff1d(np.arange(20), members)
    motion = meshes.rigid_motions(NODES)
    at_reference = meshes.rigid_motions(reference[None])
    rotation = np.hstack([np.zeros((3, 3)), np.eye(3)])
    reduced = np.vstack([motion.reshape(20, 3, 6)[free].reshape(-1, 6), at_reference, rotation])
    assert T.shape == (60, 3 * 16 + 6)
    assert np.abs(T @ reduced - motion).max() < 1e-14


def test_held_nodes_do_not_move_and_order_of_reference_points_is_that_of_the_sets():
    T = rigid_map(NODES, [([0, 1], np.zeros(3)), ([2, 3], None), ([5], np.ones(3))]).toarray()
    assert T.shape == (60, 3 * 15 + 12)
    assert not T[6:12].any()
    second = T[15:18, -6:]  # node 5 follows the second reference point only
    assert np.allclose(second[:, :3], np.eye(3))
    assert np.allclose(second[:, 3:] @ [0.1, 0.2, 0.3], np.cross([0.1, 0.2, 0.3], NODES[5] - 1.0))


def test_node_in_two_sets_and_empty_set_are_refused():
    with pytest.raises(InputError, match="node 3 belongs to rigid sets 0 and 1"):
        rigid_map(NODES, [([3, 4], None), ([3], np.zeros(3))])
    with pytest.raises(InputError, match="no nodes"):
        rigid_map(NODES, [([], None)])
    with pytest.raises(InputError, match="unknown nodes"):
        rigid_map(NODES, [([20], None)])
