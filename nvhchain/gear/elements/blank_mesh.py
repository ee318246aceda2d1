"""Transverse mesh of the blank, from the teeth's pitch meshes down to the bore.

Rows meet the radii of web and openings; columns are even.  Corners next to an opening are moved onto its outline. The
others follow by a discrete Laplace equation in the conformal plane (ln r, φ).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from nvhchain.errors import require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.cutouts import Openings, RoundCutouts
from nvhchain.gear.drawing.volume_mesh import VolumeMesh
from nvhchain.gear.elements.grading import Grading, insert_middles
from nvhchain.gear.elements.pitch_mesh import BoolArray, Curve, PlaneMesh, quadratic_mesh
from nvhchain.handoff import FloatArray, IntArray

_THIN, _THINNEST = 1.5, 0.25
"""Thickness (tooth pitches) below which a web's bending about its ends counts, and part of it below which rows stay the
same. Rows at the ends shrink by the square of the thickness: the thinner the web, the larger its part in the gear's
compliance."""

_STRIP = 0.02
"""Width of web (normal modules) between a rounded opening and hub or rim. The circles on which the thickness changes
cannot follow the opening's corners."""

_CLEAR = 0.3
"""Columns of the mesh between an opening, whose corners move columns, and the rows that stay even."""

WEB_GROWTH = 0.5
"""Growth of elements beside the ends of a thin web, per distance from there; each is some 1.5 times the one before."""


@dataclass(frozen=True, eq=False)
class BlankMesh:
    """Transverse mesh of the whole blank; it repeats after `sector` teeth.

    top : (teeth, n) nodes under each tooth's pitch, counter-clockwise.
    bore : nodes on the bore.
    web_elements : quadrilaterals of the web.
    sector_elements : quadrilaterals under the first sector of teeth.
    tooth_elements : quadrilaterals under the first tooth.
    rim_elements : quadrilaterals of the rim, which repeats with every tooth: all where all teeth are alike.
    rotated_nodes : (n,) node that replaces each node when the blank turns by one sector.
    next_nodes : (n,) node of the rim that replaces each of its nodes when it turns by one tooth, −1 below the rim.
    """

    plane: PlaneMesh
    top: IntArray
    bore: IntArray
    web_elements: BoolArray
    sector_elements: BoolArray
    tooth_elements: BoolArray
    rim_elements: BoolArray
    rotated_nodes: IntArray
    next_nodes: IntArray


def innermost_solid(body: GearBody) -> float:
    """Return the radius (m) down to which the rim is solid over the whole face width.

    InputError if the gear has an imported mesh, whose blank is not drawn.
    """
    require(
        not isinstance(body.blank, VolumeMesh),
        f"the gear of {body.geometry.teeth} teeth has a mesh of its own, which is not meshed again: draw its blank for "
        "root strain, for the reference contact and for `whole_mesh`",
    )
    web, cut = body.blank.web, body.blank.cutouts
    if web is not None:
        return web.rim_radius
    return cut.outer_radius if cut is not None else body.geometry.bore_radius


def blank_mesh(body: GearBody, top_radius: float, fidelity: GearFidelity) -> BlankMesh:
    """Mesh the blank between bore and `top_radius` (m), with two columns per tooth and unit of refinement.

    InputError if an opening, or the spoke between two, is narrower than an element.
    """
    gear, web, cut = body.geometry, body.blank.web, _openings(body)
    tooth_columns = 2 * fidelity.transverse_refinement
    columns, step = tooth_columns * gear.teeth, gear.pitch_angle / tooth_columns
    lines: FloatArray = np.arange(columns, dtype=np.float64) * step - 0.5 * gear.pitch_angle
    height, fine = _heights(body, top_radius, fidelity)
    radii = _rows(body, top_radius, height, fine)
    rows = len(radii) - 1
    whole = _whole_row(body, radii, step)
    grid = np.arange((rows + 1) * columns).reshape(rows + 1, columns)
    cell = np.ones((rows, columns), dtype=bool)

    move = np.zeros((2, rows + 1, columns))  # in ln r and φ
    curves: list[Curve] = []
    if cut is not None:
        fixed = np.zeros(move.shape, dtype=bool)
        fixed[:, 0] = fixed[:, whole:] = True
        if web is not None:
            fixed[0, [_row(radii, web.hub_radius), _row(radii, web.rim_radius)]] = True
        for i in range(cut.count):
            middle = cut.phase + 2 * np.pi * i / cut.count
            ring, radius, angle = _ring(cut, middle, radii, lines, cell)
            row, column = ring % (rows + 1), ring // (rows + 1)
            here = column % columns
            move[0, row, here] = np.log(radius[::2] / radii[row])
            move[1, row, here] = angle[::2] - (lines[0] + step * column)
            fixed[:, row, here] = True
            nodes = grid[row, here]
            curves.append(Curve(np.append(nodes, nodes[0]), radius[1::2], angle[1::2]))
        move = np.stack([_spread(m, f, np.log(radii), step) for m, f in zip(move, fixed, strict=True)])
    radius = (radii[:, None] * np.exp(move[0])).ravel()
    angle = (lines + move[1]).ravel()

    after = np.roll(grid, -1, axis=1)
    quads = np.stack([grid[:-1], grid[1:], after[1:], after[:-1]], axis=-1)[cell]
    used, number = np.unique(quads, return_inverse=True)
    new = np.full(grid.size, -1)
    new[used] = np.arange(len(used))
    curves = [Curve(new[c.corners], c.radius, c.angle) for c in curves]
    plane = quadratic_mesh(radius[used], angle[used], number.reshape(quads.shape), tuple(curves))

    rim = 0 if body.sector == 1 else whole
    turned, following = (new[np.roll(grid, -tooth_columns * teeth, axis=1)].ravel()[used] for teeth in (body.sector, 1))
    following[used // columns < rim] = -1
    pitch_columns = tooth_columns * np.arange(gear.teeth)[:, None] + np.arange(tooth_columns + 1)
    web_row = np.zeros(rows, dtype=bool)
    if web is not None:
        web_row[_row(radii, web.hub_radius) : _row(radii, web.rim_radius)] = True
    row, column = np.nonzero(cell)
    return BlankMesh(
        plane=plane,
        top=np.stack([plane.chain(new[line]) for line in grid[-1, pitch_columns % columns]]),
        bore=np.append(new[grid[0]], plane.edge_nodes(new[grid[0]], new[after[0]])),
        web_elements=web_row[row],
        sector_elements=column < tooth_columns * body.sector,
        tooth_elements=column < tooth_columns,
        rim_elements=row >= rim,
        rotated_nodes=_add_edges(plane, turned),
        next_nodes=_add_edges(plane, following),
    )


def _whole_row(body: GearBody, radii: FloatArray, step: float) -> int:
    """Return the row of corners from which on the mesh is even: above the web, and `_CLEAR` columns above openings."""
    web, cut = body.blank.web, _openings(body)
    above = 0.0 if cut is None else cut.outer_radius * (1.0 + _CLEAR * step)
    rows = max(int(np.searchsorted(radii, above)), 0 if web is None else _row(radii, web.rim_radius))
    return min(rows, len(radii) - 1)


def _add_edges(plane: PlaneMesh, turned: IntArray) -> IntArray:
    """Return the nodes that replace all nodes, from those (corners,) that replace the corners; −1 is passed on."""
    ends = turned[plane.edges]
    moved = (ends >= 0).all(axis=1)
    edges = np.full(len(ends), -1)
    edges[moved] = plane.edge_nodes(*ends[moved].T)
    return np.append(turned, edges)


def rows_over_even(body: GearBody, top_radius: float, fidelity: GearFidelity) -> float:
    """Return the rows of the blank below `top_radius` (m), relative to those of a blank without a thin web."""
    height, fine = _heights(body, top_radius, fidelity)
    rows, even = (len(_rows(body, top_radius, height, end)) - 1 for end in (fine, height))
    return rows / even


def _heights(body: GearBody, top_radius: float, fidelity: GearFidelity) -> tuple[float, float]:
    """Return the largest height of a row (m), in general and at the ends of a web.

    It is at most that of the rows under the teeth.  Far from them, towards the bore, elements may grow slender.
    """
    web, pitch = body.blank.web, top_radius * body.geometry.pitch_angle
    height = 0.5 * pitch / fidelity.transverse_refinement * fidelity.row_aspect
    part = 1.0 if web is None else min(max(web.thickness / (_THIN * pitch), _THINNEST), 1.0)
    return height, height * part**2


def _rows(body: GearBody, top_radius: float, height: float, fine: float) -> FloatArray:
    """Return the radii of the rows from the bore outwards (m), at most `height` apart, `fine` at the ends of a web."""
    web, cut = body.blank.web, _openings(body)
    ends = [] if web is None else [web.hub_radius, web.rim_radius]
    stops = [body.geometry.bore_radius, top_radius, *ends]
    stops += [] if cut is None else [cut.inner_radius, cut.outer_radius]
    middle = 0.5 * sum(ends)
    if ends and fine < height and min(abs(middle - stop) for stop in stops) > 0.1 * height:
        stops.append(middle)  # there the nearer end changes
    stops.sort()
    radii = [stops[0]]
    for stop in stops[1:]:
        if stop > radii[-1] * (1 + 1e-6):
            radii += list(_graded_radii(radii[-1], stop, height, fine, ends)[1:])
    return np.array(radii)


def _graded_radii(low: float, high: float, height: float, fine: float, ends: list[float]) -> FloatArray:
    """Return radii from `low` to `high`, at most `height` apart, and `fine` at the nearest of `ends`; all m."""
    if not ends or fine >= height:
        return np.linspace(low, high, ceil((high - low) / height - 1e-9) + 1)
    nearest = min(ends, key=lambda end: abs(end - 0.5 * (low + high)))
    return Grading(nearest, fine, 0.0, WEB_GROWTH, height).ends(low, high)


def _openings(body: GearBody) -> Openings | None:
    """Return the openings of the drawing; rounded ones are kept off the ends of the web."""
    web, cut = body.blank.web, body.blank.cutouts
    if web is None or cut is None:
        return cut
    low, high = (
        end + side * _STRIP * body.geometry.normal_module for end, side in ((web.hub_radius, 1), (web.rim_radius, -1))
    )
    if isinstance(cut, RoundCutouts):
        return replace(cut, radius=min(cut.radius, high - cut.pitch_radius, cut.pitch_radius - low))
    if cut.fillet == 0 or (low <= cut.inner_radius and cut.outer_radius <= high):
        return cut
    inner, outer = max(cut.inner_radius, low), min(cut.outer_radius, high)
    return replace(cut, inner_radius=inner, outer_radius=outer, fillet=min(cut.fillet, 0.45 * (outer - inner)))


def _row(radii: FloatArray, radius: float) -> int:
    """Return the row nearest to `radius` (m)."""
    return int(np.argmin(np.abs(radii - radius)))


def _ring(
    cut: Openings, middle: float, radii: FloatArray, lines: FloatArray, cell: BoolArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Remove one opening from `cell`, in place.

    ring : (n,) corner nodes once round, as row + (rows + 1) · column; columns count on beyond the last.
    radius, angle : (2 n,) radius (m) and angle (rad) of its corner and edge nodes in turn, on the outline.

    InputError if the opening, or the spoke beside it, is narrower than an element.
    """
    step = lines[1] - lines[0]
    # a small bias rounds ties of half a column in the same way for every opening
    low, high = (floor((middle + side * cut.angular_width / 2 - lines[0]) / step + 0.5 + 1e-6) for side in (-1, 1))
    pitch = 2 * np.pi / cut.count / step
    require(
        high > low and high - low <= pitch - 1,
        f"an opening {np.degrees(cut.angular_width):.3g}° wide, or the spoke beside it, is narrower than one element "
        f"({np.degrees(step):.3g}°): widen it or raise transverse_refinement",
    )
    inner, outer = _row(radii, cut.inner_radius), _row(radii, cut.outer_radius)
    columns, tall = np.arange(low, high + 1), np.arange(inner, outer + 1)
    cell[inner:outer, columns[:-1] % len(lines)] = False
    sides = (
        (np.full(len(columns), outer), columns),
        (tall[::-1], np.full(len(tall), high)),
        (np.full(len(columns), inner), columns[::-1]),
        (tall, np.full(len(tall), low)),
    )
    ring, radius, angle = [], [], []
    for number, (row, column) in enumerate(sides):
        ring.append((row + len(radii) * column)[:-1])
        way = np.abs(radii[row] - radii[row[0]]) if number % 2 else np.arange(len(row))  # rows may differ in height
        r, phi = cut.outline(number, insert_middles(way / way[-1])[:-1])
        radius.append(r)
        angle.append(middle + phi)
    return np.concatenate(ring), np.concatenate(radius), np.concatenate(angle)


def _spread(move: FloatArray, fixed: BoolArray, level: FloatArray, step: float) -> FloatArray:
    """Continue the fixed values of `move` over the grid by the Laplace equation, periodic in columns."""
    rows, columns = move.shape
    grid = np.arange(move.size).reshape(rows, columns)
    height = np.diff(level)
    reach = 0.5 * (np.append(height, 0.0) + np.append(0.0, height))
    links = [
        (grid.ravel(), np.roll(grid, -1, axis=1).ravel(), np.repeat(reach / step, columns)),
        (grid[:-1].ravel(), grid[1:].ravel(), np.repeat(step / height, columns)),
    ]
    i, j, w = (np.concatenate([link[n] for link in links]) for n in range(3))
    laplace = sp.coo_matrix(
        (np.concatenate([w, w, -w, -w]), (np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])))
    ).tocsr()
    free = np.flatnonzero(~fixed.ravel())
    value = np.where(fixed, move, 0.0).ravel()
    value[free] = spsolve(laplace[free][:, free], -(laplace @ value)[free])
    return value.reshape(rows, columns)
