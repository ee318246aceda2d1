"""Solid mesh of a gear: transverse meshes swept along the axis into layers of 20-node bricks.

The helix turns teeth and root rigidly with z.  Below the root circle the twist fades linearly in r and vanishes where
the solid rim ends.  Web, openings and bore therefore stay straight.

Likewise the layers are even under the teeth and meet the faces of the web at its rim.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from nvhchain.fidelity import GearFidelity
from nvhchain.gear.drawing.blank import Web
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.elements.blank_mesh import WEB_GROWTH, BlankMesh, blank_mesh, innermost_solid, rows_over_even
from nvhchain.gear.elements.grading import Grading
from nvhchain.gear.elements.pitch_mesh import BoolArray, PitchMesh, PlaneMesh, pitch_mesh
from nvhchain.handoff import FloatArray, IntArray

_THIN, _WEB_PART, _FLAT = 0.3, 0.4, 0.3
"""Three limits of thin webs. Webs with less than the first part of the layers bend about their ends. They get up to the
second part of the layers and at least two. No layer is flatter than the third part of an even one."""

_BENT = 2
"""Least layers of a web: with one layer, gears were up to 5 % too soft or too stiff."""


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """Bricks of 20 nodes on levels: even levels are layer faces, odd ones the middles of layers.

    nodes : (n, 3) positions (m).
    angle : (n,) angle of each node about the axis (rad).
    elements : (m, 20) node numbers in the order of VTK.
    index : (levels, plane nodes) node number, −1 if absent.
    """

    nodes: FloatArray
    angle: FloatArray
    elements: IntArray
    index: IntArray

    @property
    def layers(self) -> int:
        """Number of layers."""
        return len(self.index) // 2

    def stacked(self, plane_nodes: IntArray) -> IntArray:
        """Return the solid nodes above and below `plane_nodes`, level by level."""
        stacked = self.index[:, plane_nodes]
        return stacked[stacked >= 0]


@dataclass(frozen=True, eq=False)
class GearMesh:
    """Mesh of one pitch of teeth, all alike, and of the blank: transverse and solid.

    pitch, blank : transverse meshes.
    pitch_solid, blank_solid : solid meshes.
    sector_elements, tooth_elements, rim_elements : bricks of the blank under the first sector of teeth, under the first
        tooth, and in the rim.
    """

    pitch: PitchMesh
    blank: BlankMesh
    pitch_solid: SolidMesh
    blank_solid: SolidMesh
    sector_elements: BoolArray
    tooth_elements: BoolArray
    rim_elements: BoolArray


def gear_mesh(body: GearBody, fidelity: GearFidelity) -> GearMesh:
    """Mesh `body`; a fidelity too coarse for the blank is an InputError."""
    rim, (pitch, pitch_solid) = innermost_solid(body), tooth_mesh(body, fidelity)
    blank = blank_mesh(body, pitch.inner_radius, fidelity)
    stations, web_layers = _stations(body, fidelity)
    present = np.ones((len(web_layers), len(blank.plane.quads)), dtype=bool)
    present[:, blank.web_elements] = web_layers[:, None]

    def bricks(quads: BoolArray) -> BoolArray:
        return np.asarray(np.broadcast_to(quads, present.shape)[present])

    return GearMesh(
        pitch=pitch,
        blank=blank,
        pitch_solid=pitch_solid,
        blank_solid=_swept(body, blank.plane, rim, pitch.inner_radius, stations, present),
        sector_elements=bricks(blank.sector_elements),
        tooth_elements=bricks(blank.tooth_elements),
        rim_elements=bricks(blank.rim_elements),
    )


def tooth_mesh(body: GearBody, fidelity: GearFidelity) -> tuple[PitchMesh, SolidMesh]:
    """Mesh one pitch of teeth alone; return its transverse and its solid mesh."""
    pitch, (_, web_layers) = pitch_mesh(body.geometry, innermost_solid(body), fidelity), _stations(body, fidelity)
    return pitch, swept_tooth(body, pitch, len(web_layers))


def swept_tooth(body: GearBody, pitch: PitchMesh, layers: int) -> SolidMesh:
    """Sweep one pitch of teeth into even layers."""
    stations = np.linspace(-0.5, 0.5, layers + 1) * body.geometry.face_width
    present = np.ones((layers, len(pitch.plane.quads)), dtype=bool)
    return _swept(body, pitch.plane, innermost_solid(body), pitch.inner_radius, stations, present)


def even_fidelity(body: GearBody, fidelity: GearFidelity) -> GearFidelity:
    """Return the knobs with which the blank has as many layers as the teeth."""
    return fidelity.even_layers(fidelity.tooth_layers(body.geometry.relative_width))


def bricks_over_even(body: GearBody, fidelity: GearFidelity) -> float:
    """Return the bricks of the blank relative to those of a blank with even rows and layers.

    Returns about the additional effort for a thin web; 1 for imported meshes.
    """
    if isinstance(body.blank, VolumeMesh):
        return 1.0
    pitch, (stations, _) = pitch_mesh(body.geometry, innermost_solid(body), fidelity), _stations(body, fidelity)
    return rows_over_even(body, pitch.inner_radius, fidelity) * (len(stations) - 1) / fidelity.width_layers


def _stations(body: GearBody, fidelity: GearFidelity) -> tuple[FloatArray, BoolArray]:
    """Return the layer faces (m) at the rim's inner radius, and the layers that the web fills."""
    even = np.linspace(-0.5, 0.5, fidelity.width_layers + 1) * body.geometry.face_width
    web = body.blank.web
    return (even, np.ones(fidelity.width_layers, dtype=bool)) if web is None else _web_layers(web, even)


def _swept(
    body: GearBody, plane: PlaneMesh, rim: float, even_from: float, stations: FloatArray, cells: BoolArray
) -> SolidMesh:
    """Sweep `plane`; layers change from `stations` at the rim's inner radius to even ones at `even_from` (m)."""
    even = np.linspace(stations[0], stations[-1], len(stations))
    above = np.clip((plane.radius - rim) / (even_from - rim), 0.0, 1.0)
    z = stations[:, None] + above * (even - stations)[:, None]
    turn = np.clip((plane.radius - rim) / (body.geometry.root_radius - rim), 0.0, 1.0)
    return _sweep(plane, z, body.geometry.twist * turn, cells)


def _web_layers(web: Web, even: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return layer faces (m) that meet the web's faces, and the layers that the web fills."""
    width = even[-1] - even[0]
    low, high = web.offset - 0.5 * web.thickness, web.offset + 0.5 * web.thickness
    below, above = low - even[0] > 1e-6 * width, even[-1] - high > 1e-6 * width
    layers = max(len(even) - 1, _BENT + below + above)
    if round(web.thickness / width * layers) < max(_BENT, ceil(_THIN * layers)):
        count = max(2, round(web.thickness / width * layers / _FLAT))
        return _thin_web_layers(low, high, even, min(count, ceil(_WEB_PART * layers)))
    count = max(1, min(round(web.thickness / width * layers), layers - below - above))
    first = round((low - even[0]) / width * layers)
    first = min(max(first, int(below)), layers - int(above) - count) if below else 0
    if not above:
        count = layers - first
    knots = [0, first, first + count, layers]
    faces = [even[0], low, high, even[-1]]
    stations = np.interp(np.arange(layers + 1), *np.unique([knots, faces], axis=1))
    filled = np.zeros(layers, dtype=bool)
    filled[first : first + count] = True
    return stations, filled


def _thin_web_layers(low: float, high: float, even: FloatArray, count: int) -> tuple[FloatArray, BoolArray]:
    """Return `count` layers of a web from z = `low` to `high` (m), and beside it layers that grow to even ones."""
    fine, size = (high - low) / count, even[1] - even[0]
    below, above = (Grading(face, fine, 0.0, WEB_GROWTH, max(size, fine)) for face in (low, high))
    before = below.ends(even[0], low) if low - even[0] > 1e-3 * fine else np.array([low])
    after = above.ends(high, even[-1]) if even[-1] - high > 1e-3 * fine else np.array([high])
    stations = np.concatenate([before, np.linspace(low, high, count + 1)[1:-1], after])
    filled = np.zeros(len(stations) - 1, dtype=bool)
    filled[len(before) - 1 : len(before) - 1 + count] = True
    return stations, filled


def _sweep(plane: PlaneMesh, z: FloatArray, twist: FloatArray, present: BoolArray) -> SolidMesh:
    """Stack `plane` on the layer faces z (layers + 1, n) in m, turned by twist (n,) rad/m · z.

    present: (layers, quads), the existing bricks.
    """
    n, layers = len(plane.radius), len(z) - 1
    levels = np.empty((2 * layers + 1, n))
    levels[::2], levels[1::2] = z, 0.5 * (z[:-1] + z[1:])
    quads = plane.quads
    corners, edges = quads[:, :4], quads[:, 4:]
    low = 2 * n * np.arange(layers)[:, None, None]
    bricks = np.concatenate(
        [low + corners, low + 2 * n + corners, low + edges, low + 2 * n + edges, low + n + corners], axis=2
    )[present]
    used, number = np.unique(bricks, return_inverse=True)
    index = np.full(levels.size, -1)
    index[used] = np.arange(len(used))
    height, flat = levels.ravel()[used], used % n
    angle = plane.angle[flat] + twist[flat] * height
    radius = plane.radius[flat]
    return SolidMesh(
        nodes=np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height]),
        angle=angle,
        elements=number.reshape(bricks.shape),
        index=index.reshape(levels.shape),
    )
