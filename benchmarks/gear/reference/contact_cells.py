"""Teeth that can touch at one wheel angle: pressure cells on their flanks, gaps, refined teeth of both gears."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from benchmarks.gear.reference.flanks import Section, gap, move_onto_flank, opened, rolled_length, section
from benchmarks.gear.reference.patch import RefinedTooth, cell_loads, cells, refined_tooth
from benchmarks.gear.reference.resolution import ReferenceResolution
from benchmarks.gear.reference.tooth_mesh import RefinedPitch, refined_pitch
from nvhchain.errors import require
from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.tooth_compliance import CondensedTooth, condensed_tooth
from nvhchain.gear.drawing.body import GearBody
from nvhchain.gear.drawing.geometry import GearGeometry
from nvhchain.gear.drawing.pair import GearPair
from nvhchain.gear.elements.blank_mesh import innermost_solid
from nvhchain.gear.elements.gear_mesh import GearMesh, gear_mesh
from nvhchain.gear.elements.grading import Grading, insert_middles
from nvhchain.gear.elements.pitch_mesh import BoolArray
from nvhchain.handoff import FloatArray, IntArray

_SIMPSON = np.array([1.0, 4.0, 1.0]) / 6
"""Weights of a mean over a layer from its faces and middle, and over a cell's width from its ends and middle."""


@dataclass(frozen=True, eq=False)
class CellFields:
    """Cells of one tooth pair or of several that can touch.

    Parameters
    ----------
    transverse, axial : (n,) array
        t and z of their middles (m).
    width : (n,) array
        Width along t (m).
    length : (n,) array
        Length along the axis (m); both halves where one half of the width stands for both.
    gap : (n,) array
        Unloaded gap along the normal (m).
    edge : (n,) bool array
        Cells at the limit of the search range; pressure must not reach them.
    """

    transverse: FloatArray
    axial: FloatArray
    width: FloatArray
    length: FloatArray
    gap: FloatArray
    edge: BoolArray


@dataclass(frozen=True, eq=False)
class TouchingTeeth:
    """Tooth pairs that can touch at one wheel angle.

    Parameters
    ----------
    angle : float
        Wheel angle (rad).
    pairs : tuple of int
        Numbers of the tooth pairs.
    pair : (n,) int array
        Position in `pairs` of each cell.
    cells : CellFields
        Cells.
    teeth : tuple of tuples of RefinedTooth
        Refined teeth, as teeth[gear][pair].
    """

    angle: float
    pairs: tuple[int, ...]
    pair: IntArray
    cells: CellFields
    teeth: tuple[tuple[RefinedTooth, ...], ...]


@dataclass(frozen=True, eq=False)
class CoarseGear:
    """Gear as in the hybrid contact: its mesh and its condensed tooth.

    Parameters
    ----------
    body : GearBody
        Gear.
    mesh : GearMesh
        Mesh of tooth and blank.
    tooth : CondensedTooth
        Condensed tooth.
    """

    body: GearBody
    mesh: GearMesh
    tooth: CondensedTooth


def coarse_gear(body: GearBody, fidelity: GearFidelity) -> CoarseGear:
    """Mesh a gear and condense its tooth.

    Parameters
    ----------
    body : GearBody
        Gear.
    fidelity : GearFidelity
        Elements.

    Returns
    -------
    CoarseGear
        Mesh and condensed tooth.
    """
    require(
        body.offset == 0,
        f"offset = {body.offset:g} m: reference contact takes gears centred on each other, of offset 0: use `mesh_law`",
    )
    mesh = gear_mesh(body, fidelity)
    return CoarseGear(body, mesh, condensed_tooth(body.geometry, mesh, body.material))


def touching_teeth(
    pair: GearPair, coarse: tuple[CoarseGear, CoarseGear], angle: float, resolution: ReferenceResolution
) -> TouchingTeeth:
    """Refine the teeth in contact at one wheel angle: drive flanks, pinion turning counter-clockwise about z.

    Parameters
    ----------
    pair : GearPair
        Gear pair.
    coarse : tuple of 2 CoarseGear
        Pinion and wheel; the refined teeth take over their layers.
    angle : float
        Wheel angle (rad).
    resolution : ReferenceResolution
        Elements of the refined teeth.

    Returns
    -------
    TouchingTeeth
        Cells and refined teeth.

    Raises
    ------
    InputError
        If the pinion turns clockwise, the face widths differ, or a spur gear has an odd number of layers.

    Notes
    -----
    One half of the width is solved for symmetric spur gears.
    """
    require(pair.sense == 1, f"sense = {pair.sense}: the reference contact is made for sense = 1")
    layers, half = coarse[0].mesh.pitch_solid.index.shape[0] // 2, symmetric(pair)
    require(not half or layers % 2 == 0, f"width_layers = {layers}: spur gears need an even number")
    width = {c.body.geometry.face_width for c in coarse}
    require(len(width) == 1, "the reference contact needs gears of one face width")
    faces = np.linspace(0.0, 0.5, layers // 2 + 1) if half else np.linspace(-0.5, 0.5, layers + 1)
    axial = insert_middles(faces * pair.face_width)
    numbers, fields, teeth = [], [], []
    for number in _pairs(pair, angle, resolution):
        found = _one_pair(pair, coarse, angle, number, axial, resolution, half=half)
        if found is not None:
            numbers.append(number)
            fields.append(found[0])
            teeth.append(found[1])
    place = np.repeat(np.arange(len(numbers)), [len(f.gap) for f in fields])
    joined = [np.concatenate([getattr(f, name) for f in fields]) for name in CellFields.__dataclass_fields__]
    return TouchingTeeth(angle, tuple(numbers), place, CellFields(*joined), tuple(zip(*teeth, strict=True)))


def symmetric(pair: GearPair) -> bool:
    """Return True if bodies and load are mirrored about mid-width, so that one half of a tooth suffices."""
    flanks = [body.geometry.micro.drive for body in (pair.pinion, pair.wheel)]
    webs = [body.blank.web for body in (pair.pinion, pair.wheel)]
    straight = pair.base_helix_angle == 0 and pair.misalignment.in_plane == 0 and all(f.lead_slope == 0 for f in flanks)
    return straight and all(web is None or web.offset == 0 for web in webs)


def _limits(pair: GearPair, resolution: ReferenceResolution) -> tuple[float, float]:
    """Return the range of s (m) in which flanks or tip edges come close enough to be searched."""
    before, after = pair.extensions(resolution.largest_gap)
    return pair.path[0] - before, pair.path[1] + after


def _pairs(pair: GearPair, angle: float, resolution: ReferenceResolution) -> list[int]:
    """Return the tooth pairs with any part within the limits."""
    low, high = _limits(pair, resolution)
    middle = pair.pitch_point + float(pair.base_radius[1]) * angle
    spread = abs(np.tan(pair.base_helix_angle)) * pair.face_width / 2
    first, last = (middle - spread - high) / pair.base_pitch, (middle + spread - low) / pair.base_pitch
    return list(range(ceil(first), floor(last) + 1))


def _one_pair(
    pair: GearPair,
    coarse: tuple[CoarseGear, CoarseGear],
    angle: float,
    number: int,
    axial: FloatArray,
    resolution: ReferenceResolution,
    *,
    half: bool,
) -> tuple[CellFields, tuple[RefinedTooth, ...]] | None:
    """Return cells and refined teeth of pair `number`; None where its flanks are too far apart everywhere."""
    sections = [section(pair, angle, number, z, _limits(pair, resolution)) for z in axial]
    fine = (resolution.contact_element, resolution.fine_zone, resolution.growth)
    gradings = [Grading(s.nearest, *fine) for s in sections]
    count = max(g.needed(s.low, s.high) for g, s in zip(gradings, sections, strict=True))
    t = np.array([insert_middles(g.ends(s.low, s.high, count)) for g, s in zip(gradings, sections, strict=True)])
    rows = [_rows_on(sections, gear, t, resolution) for gear in (0, 1)]
    apart = np.abs(np.stack(rows) - t).max(axis=0)
    fields, kept = _candidates(pair, sections, t, apart <= resolution.contact_element, axial, resolution, half=half)
    if not len(kept):
        return None
    teeth = []
    for gear, c in enumerate(coarse):
        g, crossing = c.body.geometry, np.array([s.crossing for s in sections])
        rolled = np.array([rolled_length(pair, gear, s, row) for s, row in zip(crossing, rows[gear], strict=True)])
        upwards = slice(None) if gear == 0 else slice(None, None, -1)  # order from root to tip
        pitch = refined_pitch(
            g, rolled[:, upwards], axial, c.mesh.pitch.inner_radius, innermost_solid(c.body), resolution
        )
        part = cells(pitch.flank[:, upwards])[kept]
        own = crossing if gear == 0 else pair.line_length - crossing
        load = cell_loads(pitch.solid, part, _inwards(g, pitch, part, own, axial))
        teeth.append(refined_tooth(pitch, load, c.mesh, c.tooth, c.body.material, half=half))
    return fields, tuple(teeth)


def _candidates(
    pair: GearPair,
    sections: list[Section],
    t: FloatArray,
    matched: BoolArray,
    axial: FloatArray,
    resolution: ReferenceResolution,
    *,
    half: bool,
) -> tuple[CellFields, IntArray]:
    """Return the cells that can touch, and their numbers among all in the order of `cells`.

    matched: (levels, 2 n + 1), True where the rows of both flanks lie at `t`, to an element.
    """
    gaps_at = np.stack([_gap(pair, s, row, z) for s, row, z in zip(sections, t, axial, strict=True)])
    over_width = _SIMPSON[0] * (gaps_at[:, :-2:2] + gaps_at[:, 2::2]) + _SIMPSON[1] * gaps_at[:, 1::2]
    over_layer = [
        np.tensordot(_SIMPSON, np.stack([a[:-2:2], a[1::2], a[2::2]]), axes=1)
        for a in (over_width, t[:, 1::2], np.diff(t[:, ::2]))
    ]
    gaps, middle, width = (a.ravel() for a in over_layer)
    cells_across = t.shape[1] // 2
    common = matched[:, :-2:2] & matched[:, 1::2] & matched[:, 2::2]
    common = (common[:-2:2] & common[1::2] & common[2::2]).ravel()
    nearest = np.repeat(np.array([s.nearest for s in sections])[1::2], cells_across)
    apart = np.array([s.separation for s in sections])
    free = np.repeat(np.maximum(np.maximum(apart[:-2:2], apart[1::2]), apart[2::2]) > 0, cells_across)
    near = (np.abs(middle - nearest) < resolution.reach) & (gaps < resolution.largest_gap) & ~free
    wanted = near & common
    grid = (near | ~common).reshape(-1, cells_across)  # at the end of the involute pressure may reach the last cell
    before, after = np.ones_like(grid), np.ones_like(grid)
    before[:, 1:], after[:, :-1] = grid[:, :-1], grid[:, 1:]
    kept = np.flatnonzero(wanted)
    fields = CellFields(
        transverse=middle[kept],
        axial=np.repeat(axial[1::2], cells_across)[kept],
        width=width[kept],
        length=np.repeat(np.diff(axial[::2]), cells_across)[kept] * (1 + half),
        gap=gaps[kept],
        edge=~(before & after).ravel()[kept],
    )
    return fields, kept


def _rows_on(sections: list[Section], gear: int, t: FloatArray, resolution: ReferenceResolution) -> FloatArray:
    """Return row ends and middles (levels, 2 n + 1) in m, moved onto the flank of `gear`."""
    reach = 1.5 * resolution.reach  # includes a margin beyond the cells
    ends = zip(sections, t[:, ::2], strict=True)
    return np.array([insert_middles(move_onto_flank(s, gear, row, reach)) for s, row in ends])


def _gap(pair: GearPair, s: Section, t: FloatArray, axial: float) -> FloatArray:
    """Return the unloaded gap along the normal (m) at `t` (n,) in m: involutes, micro-geometry, misalignment."""
    t = np.clip(t, *s.ends)  # no cell beyond the ends is searched
    aligned = gap(pair, s.crossing, t) * np.cos(pair.base_helix_angle)
    return aligned + opened(pair, s.crossing, t, np.full(len(t), axial))


def _inwards(
    gear: GearGeometry, pitch: RefinedPitch, part: IntArray, crossing: FloatArray, axial: FloatArray
) -> FloatArray:
    """Return the line of action (n, 8, 3), into the tooth, in the cylindrical axes of each cell's nodes.

    A section has one direction: the common normal where the flanks cross the line of action, at the rolled length
    `crossing` (levels,) in m.
    """
    alpha = np.arctan(crossing / gear.base_radius)
    flank = gear.half_tooth_angle(np.hypot(gear.base_radius, crossing)) + gear.twist * axial
    level = np.full(len(pitch.solid.nodes), -1)
    for number, nodes in enumerate(pitch.flank):
        level[nodes[nodes >= 0]] = number
    of = level[part]
    turned = alpha[of] + pitch.solid.angle[part] - flank[of]
    tilt = gear.base_helix_angle
    return np.stack(
        [-np.cos(tilt) * np.sin(turned), -np.cos(tilt) * np.cos(turned), np.full(of.shape, np.sin(tilt))], axis=-1
    )
