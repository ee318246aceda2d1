"""Modes of a gear's body with its bore held, as they act at the teeth and on the shaft.

The body is a ring of 20-node bricks: hub, web and rim as drawn, openings by the share that they leave of every brick,
and the teeth as a ring of their mass. docs/decisions/0021-gear-bodies-vibrate.md has the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, pi, sqrt
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from nvhchain.conventions import Material
from nvhchain.errors import require
from nvhchain.fem.eigen import lowest_modes
from nvhchain.fem.elasticity import stiffness_and_mass
from nvhchain.fem.elements import HEX20_EDGES, HEX_CORNERS
from nvhchain.gear.drawing.body import GearBody, opening_outline, outline_moments, toothed_outline
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.handoff import BodyModes, ComplexArray, FloatArray, IntArray
from nvhchain.kinds import checked

FINE, COARSE = (48, 8), (24, 4)
"""Fewest bricks around the body, and between bore and tips; more where circles of web or openings ask for them."""
TOOTH_STIFFNESS = 0.1
"""Young's modulus of the ring of teeth over that of the material."""
SHARES = 4
"""Steps of the share of a brick that an opening leaves."""
SAME = 2e-3
"""Relative difference of frequencies of a pair of modes that is one travelling wave."""
NEGLIGIBLE = 1e-3
"""Part of the compliance at the teeth that is dropped with weak waves."""


@checked
def body_modes(body: GearBody, highest: float, bricks: tuple[int, int] = FINE) -> BodyModes:
    """Return the modes of a gear's body with the bore held.

    highest: highest frequency (Hz).
    bricks (int, int): fewest bricks around the body, which resolve a third as many nodal diameters, and between bore
    and tips.
    Returns waves around the body, in the order of nodal diameters.

    Every mode is a sum of waves around the axis. In the frame of the housing each wave is an oscillator of its own.
    Waves of one mode are coupled with the period of the openings; this coupling is averaged over a turn. Pairs of modes
    of one frequency, such as those of a disc, give one wave.
    """
    require(
        not isinstance(body.blank, VolumeMesh),
        f"the gear of {body.geometry.teeth} teeth has an imported mesh, whose modes are not computed: leave "
        "gear_body_modes off, or draw its blank",
    )
    found = body_elements(body, bricks)
    held = np.hypot(found.nodes[:, 0], found.nodes[:, 1]) < body.geometry.bore_radius * (1.0 + 1e-6)
    free = np.flatnonzero(np.repeat(~held, 3))
    frequency, moved = lowest_modes(found.stiffness[free][:, free], found.mass[free][:, free], highest)
    shapes = np.zeros((3 * len(found.nodes), len(frequency)))
    shapes[free] = moved
    return _waves(frequency, shapes, found)


class BodyElements(NamedTuple):
    """Finite elements of a gear's body.

    nodes : (n, 3) positions (m).
    stiffness, mass : (3 n, 3 n) sparse matrices (N/m, kg).
    rim : (levels, columns) nodes at the teeth.
    weight : (levels,) weights of the mean over the face width.
    """

    nodes: FloatArray
    stiffness: sp.csr_matrix
    mass: sp.csr_matrix
    rim: IntArray
    weight: FloatArray


def body_elements(body: GearBody, bricks: tuple[int, int] = FINE) -> BodyElements:
    """Return the finite elements of a gear's body, free of its shaft."""
    lattice = _Lattice(body, *bricks)
    groups = lattice.bricks(body)
    used, nodes = np.unique(np.concatenate([numbers.ravel() for _, numbers in groups])), lattice.nodes()
    place = np.full(len(nodes), -1)
    place[used] = np.arange(len(used))
    size = 3 * len(used), 3 * len(used)
    matrices = [sp.csr_matrix(size), sp.csr_matrix(size)]
    for material, numbers in groups:
        for i, part in enumerate(stiffness_and_mass(nodes[used], place[numbers], "hex20", material)):
            assert part is not None
            part.resize(size)  # the highest numbers may not be among these bricks
            matrices[i] = matrices[i] + part
    return BodyElements(nodes[used], matrices[0], matrices[1], place[lattice.rim()], lattice.weight)


class _Lattice:
    """Lattice of cylinders, half-planes and levels; every second one bounds bricks.

    radius : (2 rows + 1,) radii (m).
    columns : bricks around.
    level : (2 layers + 1,) axial positions (m).
    """

    def __init__(self, body: GearBody, columns: int, rows: int) -> None:
        geometry, web, cut = body.geometry, body.blank.web, body.blank.cutouts
        area = outline_moments(*toothed_outline(geometry))[0]
        self.root, self.outer = geometry.root_radius, sqrt(area / pi)
        circles, faces = [geometry.bore_radius, self.root, self.outer], [-0.5 * geometry.face_width]
        faces.append(0.5 * geometry.face_width)
        if web is not None:
            circles += [web.hub_radius, web.rim_radius]
            faces += [web.offset - 0.5 * web.thickness, web.offset + 0.5 * web.thickness]
        if cut is not None:
            circles += [cut.inner_radius, cut.outer_radius]
        self.radius = _divided(circles, (self.outer - geometry.bore_radius) / rows)
        self.level = _divided(faces, 0.4 * geometry.face_width)
        count = 1 if cut is None else cut.count
        self.columns = count * ceil(columns / count)

    def nodes(self) -> FloatArray:
        """Return the positions (n, 3) (m) of all points of the lattice, by level, radius and column."""
        angle = np.arange(2 * self.columns) * pi / self.columns
        z, r, a = np.meshgrid(self.level, self.radius, angle, indexing="ij")
        return np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1).reshape(-1, 3)

    def _numbers(self, level: IntArray, row: IntArray, column: IntArray) -> IntArray:
        column_count = 2 * self.columns
        return np.asarray((level * len(self.radius) + row) * column_count + column % column_count)

    def rim(self) -> IntArray:
        """Return the points (levels, columns) on the outer cylinder between bricks."""
        levels, columns = np.arange(len(self.level)), 2 * np.arange(self.columns)
        return self._numbers(levels[:, None], np.array(len(self.radius) - 1), columns[None, :])

    @property
    def weight(self) -> FloatArray:
        """Weights (levels,) of the mean over the face width (Simpson)."""
        height = np.diff(self.level[::2])
        weight = np.zeros(len(self.level))
        for i, each in enumerate(height):
            weight[2 * i : 2 * i + 3] += each * np.array([1.0, 4.0, 1.0]) / 6.0
        return weight / weight.sum()

    def bricks(self, body: GearBody) -> list[tuple[Material, IntArray]]:
        """Return the bricks (n, 20) of every material: the gear's, thinned by openings, and that of the teeth."""
        web, share, material = body.blank.web, self._shares(body), body.material
        middle_r, middle_z = self.radius[1::2], self.level[1::2]
        factor = np.ones((len(middle_z), len(middle_r), self.columns))
        solid = np.ones((len(middle_z), len(middle_r)), dtype=bool)
        if web is not None:
            web_rows = (middle_r > web.hub_radius) & (middle_r < web.rim_radius)
            solid = ~web_rows | (np.abs(middle_z - web.offset) < 0.5 * web.thickness)[:, None]
        factor *= solid[:, :, None] * share
        offset = np.vstack([HEX_CORNERS, [(HEX_CORNERS[i] + HEX_CORNERS[j]) / 2 for i, j in HEX20_EDGES]]) + 1
        step = np.rint(offset).astype(np.int64)
        teeth = np.broadcast_to((middle_r > self.root)[None, :, None], factor.shape)
        groups = []
        for part in np.arange(1, SHARES + 1) / SHARES:
            for tooth in (False, True):
                level, row, column = np.nonzero((factor == part) & (teeth == tooth))
                if len(level):
                    numbers = self._numbers(
                        2 * level[:, None] + step[:, 2], 2 * row[:, None] + step[:, 0], 2 * column[:, None] + step[:, 1]
                    )
                    young = part * material.young * (TOOTH_STIFFNESS if tooth else 1.0)
                    groups.append((Material(young, material.poisson, part * material.density), numbers))
        return groups

    def _shares(self, body: GearBody) -> FloatArray:
        """Return the share (rows, columns) of every brick that the openings leave."""
        cut = body.blank.cutouts
        share = np.ones((len(self.radius) // 2, self.columns))
        if cut is None:
            return share
        fine = (np.arange(8) + 0.5) / 8.0
        low, high = self.radius[:-1:2], self.radius[2::2]
        radius = low[:, None] + (high - low)[:, None] * fine
        angle = (np.arange(self.columns)[:, None] + fine) * 2.0 * pi / self.columns
        pitch = 2.0 * pi / cut.count
        turned = (angle - cut.phase + 0.5 * pitch) % pitch - 0.5 * pitch
        r, a = np.meshgrid(radius.ravel(), turned.ravel(), indexing="ij")
        edge_r, edge_a = opening_outline(cut)
        inside = _contains(r * np.cos(a), r * np.sin(a), edge_r * np.cos(edge_a), edge_r * np.sin(edge_a))
        inside = inside.reshape(len(low), 8, self.columns, 8).mean(axis=(1, 3))
        return np.asarray(np.rint(SHARES * (share - inside)) / SHARES)


def _divided(ends: Sequence[float], size: float) -> FloatArray:
    """Return places from the lowest to the highest end through all others, at most half of `size` apart."""
    places = np.unique(np.round(ends, 9))
    parts = [np.linspace(a, b, 2 * max(1, ceil((b - a) / size)) + 1)[:-1] for a, b in pairwise(places)]
    return np.concatenate([*parts, places[-1:]])


def _contains(x: FloatArray, y: FloatArray, edge_x: FloatArray, edge_y: FloatArray) -> FloatArray:
    """Return 1 where points lie inside a polygon, else 0, by the crossings of its edges."""
    inside = np.zeros(x.shape, dtype=bool)
    for x1, y1, x2, y2 in zip(edge_x, edge_y, np.roll(edge_x, -1), np.roll(edge_y, -1), strict=True):
        crosses = (y1 > y) != (y2 > y)
        if y1 != y2:
            inside ^= crosses & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside.astype(float)


def _rim_motion(shapes: FloatArray, elements: BodyElements) -> FloatArray:
    """Return the motion (columns, 3, n_mode) of the rim along r, φ and z, mean over the face width."""
    motion = np.einsum("l,lcam->cam", elements.weight, shapes.reshape(len(elements.nodes), 3, -1)[elements.rim])
    angle = np.arctan2(elements.nodes[elements.rim[0], 1], elements.nodes[elements.rim[0], 0])
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = motion[:, 0], motion[:, 1], motion[:, 2]
    return np.stack([c * x + s * y, c * y - s * x, z], axis=1)


def _waves(frequency: FloatArray, shapes: FloatArray, elements: BodyElements) -> BodyModes:
    """Return the waves of all modes, from their mass-normalised shapes (3 n, n_mode)."""
    nodes, rim = elements.nodes, _rim_motion(shapes, elements)
    x, y, z = nodes.T
    zero, one = np.zeros(len(x)), np.ones(len(x))
    carried = np.asarray(elements.mass @ shapes).reshape(len(nodes), 3, -1)
    u, v = shapes.reshape(len(nodes), 3, -1)[:, 0], shapes.reshape(len(nodes), 3, -1)[:, 1]
    turning = u.T @ carried[:, 1] - v.T @ carried[:, 0]
    rigid = {
        "x": (one, zero, zero), "y": (zero, one, zero), "z": (zero, zero, one),
        "about x": (zero, -z, y), "about y": (z, zero, -x), "about z": (-y, x, zero),
        "axial x": (zero, zero, y), "axial y": (zero, zero, -x),
    }  # fmt: skip
    part = {name: np.einsum("na,nam->m", np.stack(motion, axis=1), carried) for name, motion in rigid.items()}
    rim_harmonics = np.fft.rfft(rim, axis=0) / len(rim)
    found: list[tuple[float, int, float, ComplexArray]] = []
    first = 0
    while first < len(frequency):
        last = first + int(np.searchsorted(frequency[first:], frequency[first] * (1.0 + SAME), side="right"))
        modes, own = slice(first, last), -turning[first:last, first:last]
        for n in range(len(rim) // 3 + 1):
            rim_amplitude = rim_harmonics[n, :, modes].T * (sqrt(2.0) if n else 1.0)
            hub_amplitude = np.zeros((last - first, 3), dtype=complex)
            if n == 0:
                hub_amplitude[:, 0], hub_amplitude[:, 1] = part["z"][modes], part["about z"][modes]
            if n == 1:
                for k, name in enumerate(("{}", "about {}", "axial {}")):
                    hub_amplitude[:, k] = (part[name.format("x")] - 1j * part[name.format("y")])[modes] / sqrt(2.0)
            left, size, right = np.linalg.svd(np.hstack([rim_amplitude, hub_amplitude]), full_matrices=False)
            for k in range(len(size)):
                coriolis = float((left[:, k].conj() @ own @ left[:, k]).imag) if n else 0.0
                found.append((float(frequency[modes].mean()), n, coriolis, size[k] * right[k]))
        first = last
    return _strong(found)


def _strong(found: Sequence[tuple[float, int, float, ComplexArray]]) -> BodyModes:
    """Return the waves without those that together carry a negligible part of the compliance at the teeth."""
    compliance = np.array([(np.abs(shape[:3]) ** 2).sum() / frequency**2 for frequency, _, _, shape in found])
    order = np.argsort(compliance)
    weak = order[np.cumsum(compliance[order]) < NEGLIGIBLE * compliance.sum()]
    kept = sorted((each for i, each in enumerate(found) if i not in weak), key=lambda each: (each[1], each[0]))
    shapes = np.array([each[3] for each in kept]).reshape(-1, 6)
    return BodyModes(
        frequency=np.array([each[0] for each in kept]),
        diameters=np.array([each[1] for each in kept], dtype=np.int64),
        coriolis=np.array([each[2] for each in kept]),
        rim=shapes[:, :3],
        hub=shapes[:, 3:],
    )
