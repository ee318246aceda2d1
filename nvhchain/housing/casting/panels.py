"""Named parts of a radiating surface: bosses, walls and flange of the casting, node groups of an imported model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nvhchain.errors import require
from nvhchain.handoff import FloatArray, IntArray, Surface
from nvhchain.housing.casting.casting import REAR, Casting
from nvhchain.housing.casting.mesh import engine_plane_faces

_SAME_PLACE = 1e-9
"""Largest difference of two distances to node groups that count as one, over the surface's extent."""


@dataclass(frozen=True, eq=False)
class Panels:
    """Names of the panels, and the number (n_face,) of the panel of each face."""

    names: tuple[str, ...]
    part: IntArray

    def __post_init__(self) -> None:
        require(len(set(self.names)) == len(self.names) > 0, f"panels: names must be distinct, got {self.names}")
        require(
            bool((self.part >= 0).all() and (self.part < len(self.names)).all()),
            f"panels: a face belongs to none of the {len(self.names)} parts",
        )


def casting_panels(casting: Casting, surface: Surface) -> Panels:
    """Return rear bosses by bearing, rear wall, flange, engine side, and the side wall by its direction."""
    centre, normal = surface.centroids, surface.normals
    names = ["side wall +x", "side wall −x", "side wall +y", "side wall −y", "rear wall", "flange", "engine side"]
    along_x = np.abs(normal[:, 0]) >= np.abs(normal[:, 1])
    part = np.where(along_x, np.where(normal[:, 0] >= 0, 0, 1), np.where(normal[:, 1] >= 0, 2, 3))
    edge = surface.areas.mean() ** 0.5
    part[centre[:, 2] > casting.depth - casting.chamfer] = 4
    part[(centre[:, 2] < casting.flange_thickness + 0.25 * edge) & (np.abs(normal[:, 2]) > 0.5)] = 5
    part[centre[:, 2] < 0.9 * casting.flange_thickness] = 5
    part[engine_plane_faces(surface)] = 6
    for bore in casting.bores_in(REAR):
        reach = bore.radius + casting.boss_thickness + 0.1 * edge
        distance = np.hypot(centre[:, 0] - bore.centre[0], centre[:, 1] - bore.centre[1])
        part[(distance < reach) & (centre[:, 2] > casting.depth - 0.1 * edge)] = len(names)
        names.append(f"boss {bore.name}")
    return Panels(tuple(names), part)


def group_panels(surface: Surface, groups: Mapping[str, FloatArray]) -> Panels:
    """Return panels from `groups`, name → points (n, 3) m.

    Each face belongs to the group of its nearest point, and to the smallest of several such groups.
    """
    require(len(groups) > 0, "no groups are given: at least one is needed")
    distance = np.array([cKDTree(points).query(surface.centroids)[0] for points in groups.values()])
    near = distance <= distance.min(axis=0) + _SAME_PLACE * np.ptp(surface.vertices, axis=0).max()
    size = np.array([len(points) for points in groups.values()])
    return Panels(tuple(groups), np.where(near, size[:, None], size.max() + 1).argmin(axis=0))
