"""Closed forms for held teeth and their tips (`gear.contact.local_law`) against finite elements of plane sections.

    python -m benchmarks tip_edge

Half a tooth with the rim below it, held on its centre line, below and beside the rim (scikit-fem, quadratic triangles
refined towards the load): under a short even load at several distances from the tip, which gives the excess over the
Weber–Banaschek bracket; and its tip edge pressed on a half-plane, which gives the approach. Writes
docs/measured/gear/tip_edge.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse.linalg as sl

from benchmarks.gear.reference import pressed
from benchmarks.publish import publish
from nvhchain.conventions import STEEL
from nvhchain.gear import GearGeometry
from nvhchain.gear.contact.local_law import TipEdges, half_space_compliance, held_excess, local_law, wedge_excess
from nvhchain.handoff import FloatArray, IntArray

if TYPE_CHECKING:
    import skfem as sk

PART = half_space_compliance(STEEL)
PLACES = (3.0, 1.8, 0.9, 0.6, 0.4, 0.2, 0.1, 0.05, 0.02, 0.005)
"""Distances from the tip over the depth h at the tip."""
FOOT = 0.97
"""The last one, over the length of the flank."""


def gear(teeth: int, module: float, **changes: float) -> GearGeometry:
    """Spur gear."""
    return GearGeometry(
        teeth=teeth,
        normal_module=module,
        normal_pressure_angle=np.radians(20.0),
        helix_angle=0.0,
        face_width=20e-3,
        bore_radius=0.15 * teeth * module,
        **changes,
    )


GEARS = {
    "20 teeth": gear(20, 2.7e-3),
    "30 teeth": gear(30, 2.68e-3),
    "50 teeth": gear(50, 2.7e-3),
    "82 teeth": gear(82, 2.68e-3),
    "57 teeth, x = 0.36": gear(57, 2.6e-3, profile_shift=0.3614, tip_radius=77.25e-3),
}


@dataclass(frozen=True, eq=False)
class Section:
    """Held half tooth.  mesh: m, x along the centre line.  flank: (n,) its facets.  along: (2, n) m, of both ends of
    these, from the tip along the flank."""

    mesh: sk.MeshTri
    flank: IntArray
    along: FloatArray


def rolled_from_tip(g: GearGeometry, radius: FloatArray) -> FloatArray:
    """Distance along the flank from the tip, m."""
    rolled = g.base_radius * g.roll_angle_at(radius)
    return (g.usable_flank[1] ** 2 - rolled**2) / (2 * g.base_radius)


def radius_at(g: GearGeometry, distance: float) -> float:
    """Radius, m, at a distance along the flank from the tip, m."""
    return float(np.hypot(g.base_radius, np.sqrt(g.usable_flank[1] ** 2 - 2 * g.base_radius * distance)))


def section(g: GearGeometry, start: float, end: float, size: float) -> Section:
    """Elements of `size`, m, on the flank from `start` to `end`, m from the tip, growing away from there."""
    import skfem as sk

    fillet, low, high = g.fillet(np.linspace(1, 0, 9)), g.form_radius, g.tip_circle_radius
    rows = np.linspace(low, high, 65)[1:]
    radius = np.append(fillet[0], rows)
    half = np.append(fillet[1], g.half_tooth_angle(rows))
    share = np.linspace(0, 1, 9)
    rim = np.linspace(g.root_radius - 1.5 * g.normal_module, g.root_radius, 8)[:-1]
    beside = np.linspace(half[0], np.pi / g.teeth, 7)[1:]
    r = np.concatenate([np.repeat(radius, 9), np.full(6, radius[0]), np.repeat(rim, 15)])
    angle = np.concatenate([np.outer(half, share).ravel(), beside, np.tile(np.append(half[0] * share, beside), 7)])
    tooth = np.arange(9 * len(radius)).reshape(-1, 9)
    below = np.vstack([len(r) - 105 + np.arange(105).reshape(7, 15), np.append(tooth[0], tooth.size + np.arange(6))])
    triangles = []
    for block in (tooth, below):
        a, b, c, d = (x.ravel() for x in (block[:-1, :-1], block[1:, :-1], block[1:, 1:], block[:-1, 1:]))
        triangles += [np.stack([a, b, c]), np.stack([a, c, d])]
    mesh = sk.MeshTri(np.stack([r * np.cos(angle), r * np.sin(angle)]), np.hstack(triangles))

    at = np.linspace(start, end, 200)
    loaded = np.array([radius_at(g, s) for s in at])
    psi = g.half_tooth_angle(loaded)
    points = np.stack([loaded * np.cos(psi), loaded * np.sin(psi)])
    while True:
        middle = mesh.p[:, mesh.t].mean(axis=1)
        away = np.hypot(*(middle[:, :, None] - points[:, None])).min(axis=1)
        edges = np.hypot(*(mesh.p[:, mesh.t[[1, 2, 0]]] - mesh.p[:, mesh.t])).max(axis=0)
        coarse = np.flatnonzero(edges > np.maximum(size, 0.25 * away))
        if not len(coarse):
            break
        mesh = mesh.refined(coarse)
    facets = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, facets]]
    at_r, at_angle = np.hypot(*ends), np.arctan2(ends[1], ends[0])
    on = (at_r > low + 1e-9).all(axis=0) & (np.abs(at_angle - g.half_tooth_angle(at_r)) * at_r < 2e-6).all(axis=0)
    return Section(mesh, facets[on], np.sort(rolled_from_tip(g, at_r[:, on]), axis=0))


def flank_answers(g: GearGeometry, s: Section, cells: list[IntArray]) -> FloatArray:
    """(n, n) m per N/m: mean normal displacement of cells (facets each) under even loads on cells."""
    import skfem as sk
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    basis = sk.Basis(s.mesh, sk.ElementVector(sk.ElementTriP2()))
    stiffness = sk.asm(linear_elasticity(*lame_parameters(STEEL.young, STEEL.poisson)), basis).tocsc()
    loads = []
    for cell in cells:
        x, y = s.mesh.p[:, s.mesh.facets[:, cell]].mean(axis=(1, 2))
        alpha = float(g.pressure_angle_at(np.hypot(x, y)))
        radial, around = np.array([x, y]) / np.hypot(x, y), np.array([-y, x]) / np.hypot(x, y)
        n = -np.sin(alpha) * radial - np.cos(alpha) * around
        form = sk.LinearForm(lambda v, _, n=n: v[0] * n[0] + v[1] * n[1])
        load = sk.asm(form, sk.FacetBasis(s.mesh, basis.elem, facets=cell))
        size = np.hypot(*np.diff(s.mesh.p[:, s.mesh.facets[:, cell]], axis=1)[:, 0]).sum()
        loads.append(load / size)
    facets = s.mesh.boundary_facets()
    x, y = s.mesh.p[:, s.mesh.facets[:, facets]]
    low, side = g.root_radius - 1.5 * g.normal_module, np.pi / g.teeth
    held = (np.abs(y) < 1e-12).all(axis=0) | (np.hypot(x, y) < low + 1e-9).all(axis=0)
    held |= (np.arctan2(y, x) > side - 1e-9).all(axis=0)
    free = np.setdiff1d(np.arange(stiffness.shape[0]), basis.get_dofs(facets[held]).all())
    right = np.array(loads).T
    answer = sl.splu(stiffness[free][:, free].tocsc()).solve(right[free])
    return np.asarray(right[free].T @ answer)


def excess(g: GearGeometry, distance: float) -> tuple[float, float]:
    """(elements, formula): bracket of a held tooth beyond Weber and Banaschek's at a distance from the tip, m."""
    depth = float(g.depth_to_centre_line(radius_at(g, distance)))
    reach = min(0.03 * depth, 0.2 * distance)
    s = section(g, distance - reach, distance + reach, reach / 4)
    middle = s.along.mean(axis=0)
    patch = np.abs(middle - distance) < reach
    start, end = s.along[0, patch].min(), s.along[1, patch].max()
    answer = flank_answers(g, s, [s.flank[patch]])[0, 0] / PART
    # mean of −ln|x − s| of an even load over itself: 3/2 − ln of its length
    formula = np.log(depth) + 1.5 - np.log(end - start) - 0.5 / (1 - STEEL.poisson)
    wedge = np.pi / 2 + float(g.pressure_angle_at(g.tip_circle_radius))
    at = 0.5 * (start + end)
    closed = wedge_excess(np.array(at), np.array(0.0), np.array(depth), wedge)
    return answer - formula, held_excess(STEEL.poisson) + float(closed)


CELL, CELLS = 4e-6, 60
RADIUS = 4e-3
"""m, ρ of the edge's flank against the half-plane."""


def edge_table(g: GearGeometry) -> list[str]:
    """The tip edge on a half-plane seen from the same depth: approach by cells of elements and by the law."""
    s = section(g, 0.0, CELL * CELLS, 0.5 * CELL)
    number = np.floor(s.along.mean(axis=0) / CELL).astype(int)
    cells = [s.flank[number == k] for k in range(CELLS)]
    start = np.array([s.along[0, number == k].min() for k in range(CELLS)])
    end = np.array([s.along[1, number == k].max() for k in range(CELLS)])
    x, width = 0.5 * (start + end), end - start
    depth = float(g.depth_to_centre_line(g.tip_circle_radius))

    def antiderivative(a: FloatArray) -> FloatArray:
        return a**2 * (0.5 * np.log(np.abs(a) + 1e-300) - 0.75)

    corners = [np.subtract.outer(a, b) for a in (end, start) for b in (start, end)]
    mean_log = sum(sign * antiderivative(c) for sign, c in zip((1, -1, -1, 1), corners, strict=True))
    mean_log = mean_log / np.outer(width, width)
    plane = PART * (np.log(depth) - 0.5 / (1 - STEEL.poisson) - mean_log)
    compliance = flank_answers(g, s, cells) + plane
    wedge = np.array([np.pi / 2 + float(g.pressure_angle_at(g.tip_circle_radius)), np.pi])
    lines = [
        "| φ / rad | load / (N/mm) | approach, elements / µm | tip edge / % | full flank / % |",
        "|---:|---:|---:|---:|---:|",
    ]
    for angle in (0.0, 0.01, 0.03, 0.06):
        for load in (5e4, 2e5, 3e5):
            found = pressed(0.5 * (compliance + compliance.T), angle * x + x**2 / (2 * RADIUS), load)
            if found.force[-1] > 0:
                continue  # more strip than cells
            h, q = np.array([depth]), np.array([load])
            edges = TipEdges(np.array([[0.0], [1.0]]), np.array([angle]), wedge)
            law = local_law(np.array([RADIUS]), (h, h), (STEEL, STEEL), edges=edges, held=(True, False))
            plain = local_law(np.array([RADIUS]), (h, h), (STEEL, STEEL))
            error = [100 * (float(one.deflection(q)[0]) / found.approach - 1) for one in (law, plain)]
            lines.append(
                f"| {angle:g} | {1e-3 * load:g} | {1e6 * found.approach:.3f} | {error[0]:+.1f} | {error[1]:+.1f} |"
            )
    return lines


def main() -> None:
    lines = [
        "Finite elements of plane sections against the closed forms of",
        "`nvhchain.gear.contact.local_law`.",
        "",
        "**Bracket of a held tooth beyond Weber and Banaschek's** (finite elements / formula), distance from the tip",
        "over the depth there",
        "",
        "| gear | foot | " + " | ".join(f"{p:g}" for p in PLACES) + " |",
        "|---|---:|" + "---:|" * len(PLACES),
    ]
    for name, g in GEARS.items():
        depth = float(g.depth_to_centre_line(g.tip_circle_radius))
        foot = FOOT * float(rolled_from_tip(g, np.array(g.form_radius)))
        found = [excess(g, d) for d in (foot, *(p * depth for p in PLACES))]
        lines.append(f"| {name} | " + " | ".join(f"{a:.3f} / {b:.3f}" for a, b in found) + " |")
    lines += ["", "**Tip edge of the gear with 20 teeth on a half-plane**, deviation of the two local laws", ""]
    lines += edge_table(GEARS["20 teeth"])
    lines += ["", "**The same, 50 teeth**", "", *edge_table(GEARS["50 teeth"])]
    publish("gear/tip_edge", "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
