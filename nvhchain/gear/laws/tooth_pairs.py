"""Tooth pairs in contact as coupled springs, from the contact problem of the pair as drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from nvhchain.fidelity import GearFidelity
from nvhchain.gear.compliance.analytic import SliceCompliance
from nvhchain.gear.compliance.flank_compliance import FlankCompliance
from nvhchain.gear.contact.contact_lines import mesh_order
from nvhchain.gear.contact.contact_lines import separation as unloaded_gap
from nvhchain.gear.contact.engagement import Engagement, close_edges
from nvhchain.gear.contact.local_law import LocalLaw, TipEdges, local_law
from nvhchain.gear.contact.slice_forces import slice_forces
from nvhchain.gear.drawing.pair import BACK, DRIVE, GearPair
from nvhchain.gear.laws.mesh_law import pair_compliances
from nvhchain.gear.laws.transmission_error import deflection_at_force
from nvhchain.handoff import FloatArray, IntArray, MeshLaw, ToothPairs
from nvhchain.kinds import checked

SOLVED, TABULATED = 40, 256
"""Approaches at which a pair is solved, and at which its force is tabulated between them."""
GRADING = 2.0
"""Exponent of the spacing of the approaches that are solved, densest at first contact."""
REACH, EARLY = 1.5, 40e-6
"""Largest approach of a tooth pair over that of the law, and beyond (m): pairs that meet early are pressed further."""
RESIDUAL = 1e-6
"""Residual of a pair alone, relative to its approach; the springs err far more."""

Pattern = tuple[FloatArray, FloatArray, FloatArray]
"""Approach at first contact (…, pair) in m, force alone (…, pair, approach) in N, weights (…, pair, slice)."""


@checked
def tooth_pairs(
    pair: GearPair,
    law: MeshLaw,
    *,
    nominal_force: float,
    fidelity: GearFidelity,
    compliances: tuple[FlankCompliance | SliceCompliance, FlankCompliance | SliceCompliance] | None = None,
) -> ToothPairs:
    """Compute force, coupling and load pattern of every tooth pair over the body period.

    nominal_force: force along the flank normal (N).

    Each pair is solved alone. Its load pattern is that at the mean deflection under the nominal force. The coupling is
    that of two load patterns through the compliance of the bodies.
    """
    engagement = Engagement(pair, compliances or pair_compliances(pair, fidelity), fidelity)
    engagement = close_edges(engagement, law.deflection[-1], -law.deflection[0] - pair.backlash)
    loaded = float(deflection_at_force(law, nominal_force).mean())
    reach = max(law.deflection[-1], -law.deflection[0] - pair.backlash)
    approach = np.linspace(0.0, REACH * reach + EARLY, TABULATED)
    found = [_fields(engagement, float(angle), flank) for flank in (DRIVE, BACK) for angle in law.angle]
    most = max(1, *(len(one["order"]) for one in found))
    slices = max(1, *(one["gap"].shape[-1] for one in found))
    sizes = {"pair": most, "slice": slices, "other_slice": slices}
    shape = (2, len(law.angle))
    fields: dict[str, Any] = {
        name: _stacked([one[name] for one in found], axes, sizes).reshape(*shape, *(sizes[axis] for axis in axes))
        for name, axes in _AXES.items()
    }
    for name in ("radius", "depth", "edge"):
        fields[name] = np.stack([fields.pop(f"{gear}_{name}") for gear in ("pinion", "wheel")])
    fields["order"] = fields["order"].astype(np.int64)
    pair_shape = (*shape, most)
    raw = ToothPairs(
        angle=law.angle,
        period=law.period,
        loaded=loaded,
        approach=approach,
        count=np.array([len(one["order"]) for one in found]).reshape(2, -1),
        held=np.array([not isinstance(c, SliceCompliance) for c in engagement.compliances], np.int64),
        first_contact=np.zeros(pair_shape),
        force=np.zeros((*pair_shape, TABULATED)),
        coupling=np.zeros((*pair_shape, most)),
        **fields,
    )
    solved = [solved_alone(pair, raw, flank, raw.gap[flank][None]) for flank in (DRIVE, BACK)]
    first, force, weight = (np.concatenate(parts) for parts in zip(*solved, strict=True))
    coupling = np.zeros((*pair_shape, most))
    for number, one in enumerate(found):
        place = divmod(number, len(law.angle))
        pattern = np.zeros((most, one["coupled"].shape[0]))
        for p, inside in enumerate(one["members"]):
            pattern[p, inside] = weight[place][p, : len(inside)]
        coupling[place] = (pattern @ one["coupled"] @ pattern.T) * (1.0 - np.eye(most))
    return raw.replace(first_contact=first, force=force, weight=weight, coupling=coupling)


_SLICED = (
    "gap",
    "length",
    "axial",
    "curvature",
    "edge_angle",
    "weight",
    *(f"{gear}_{name}" for name in ("radius", "depth", "edge") for gear in ("pinion", "wheel")),
)
_AXES = {
    "order": ("pair",),
    "compliance": ("pair", "slice", "other_slice"),
    **dict.fromkeys(_SLICED, ("pair", "slice")),
}
"""Field of one angle → its axes."""


def _stacked(parts: list[FloatArray], axes: tuple[str, ...], sizes: dict[str, int]) -> FloatArray:
    """Return arrays of several angles as one, padded with zeros."""
    room = np.zeros((len(parts), *(sizes[name] for name in axes)))
    for place, values in zip(room, parts, strict=True):
        place[tuple(slice(0, n) for n in values.shape)] = values
    return room


def _fields(engagement: Engagement, angle: float, flank: int) -> dict[str, Any]:
    """Return the fields of all pairs at one angle; `coupled` is the compliance of all slices, `members` theirs."""
    lines = engagement.lines(angle, flank)
    coupled, order = engagement.compliance(lines), mesh_order(engagement.pair, lines)[0]
    teeth = np.unique(order)[::-1]
    members = [np.flatnonzero(order == tooth) for tooth in teeth]
    size = max((len(inside) for inside in members), default=1)
    own = np.zeros((len(teeth), size, size))
    for place, inside in zip(own, members, strict=True):
        place[: len(inside), : len(inside)] = coupled[np.ix_(inside, inside)]

    def spread(values: FloatArray) -> FloatArray:
        room = np.zeros((len(members), size))
        for place, inside in zip(room, members, strict=True):
            place[: len(inside)] = values[inside]
        return room

    fields: dict[str, Any] = {
        "order": teeth.astype(float),
        "compliance": own,
        "gap": spread(unloaded_gap(engagement.pair, lines)),
        "length": spread(lines.length),
        "axial": spread(lines.axial),
        "curvature": spread(lines.curvature),
        "edge_angle": spread(lines.edges.angle),
        "weight": spread(lines.length / lines.length.sum()),
    }
    for number, gear in enumerate(("pinion", "wheel")):
        fields[f"{gear}_radius"] = spread(lines.radius[number])
        fields[f"{gear}_depth"] = spread(lines.depth[number])
        fields[f"{gear}_edge"] = spread(lines.edges.distance[number])
    return fields | {"coupled": coupled, "members": members}


def solved_alone(
    pair: GearPair, pairs: ToothPairs, flank: int, gap: FloatArray, begin: FloatArray | None = None
) -> Pattern:
    """Solve every pair alone with given unloaded gaps.

    gap (n_gap, n_angle, n_pair, n_slice): unloaded gaps of every slice (m), one after the other.
    begin (n_angle, n_pair): approach at which the forces begin (m); by default that at first contact of each gap.
    Returns first_contact (n_gap, n_angle, n_pair): approach at first contact (m). force (n_gap, n_angle, n_pair,
    n_approach): force (N) at the approaches of `pairs` beyond `begin`. weight (n_gap, n_angle, n_pair, n_slice): share
    of each slice in the force at the nominal deflection.
    """
    there = pairs.length[flank] > 0
    law, length = _local_laws(pair, pairs, flank, there), np.array(pairs.length[flank])
    number = np.full(there.shape, -1)
    number[there] = np.arange(int(there.sum()))
    steps = pairs.approach[-1] * (np.arange(SOLVED + 1) / SOLVED) ** GRADING
    first, weight = np.zeros(gap.shape[:3]), np.zeros(gap.shape)
    total = np.zeros((*gap.shape[:3], len(steps)))
    for index in zip(*np.nonzero(there.any(axis=-1)), strict=True):
        n, here = int(there[index].sum()), (slice(None), *index)
        own, bent = gap[here][:, :n], pairs.weight[flank][index][:n]
        first[here] = own.min(axis=1)
        mean = own @ bent / bent.sum() if bent.sum() > 0 else first[here]
        start = first[here] if begin is None else np.full(len(own), begin[index])
        levels = np.column_stack([start[:, None] + steps, mean + pairs.loaded])
        forces = slice_forces(
            np.array(pairs.compliance[flank][index][:n, :n]),
            (levels[:, :, None] - own[:, None]).reshape(-1, n),
            length[index][:n],
            law.select(number[index][:n]),
            tolerance=RESIDUAL,
        ).reshape(*levels.shape, n)
        sums = forces.sum(axis=2)
        total[here] = sums[:, :-1]
        loaded = sums[:, -1:]
        weight[here][:, :n] = np.where(loaded > 0, forces[:, -1] / np.where(loaded > 0, loaded, 1.0), 1.0 / n)
    return first, np.asarray(PchipInterpolator(steps, total, axis=-1)(pairs.approach)), weight


def _local_laws(pair: GearPair, pairs: ToothPairs, flank: int, there: IntArray) -> LocalLaw:
    """Return the local law of all slices of a flank, in the order of the mask `there` (n_angle, n_pair, n_slice)."""
    tips = np.array([geometry.usable_flank[1] for geometry in pair.geometries])
    edges = TipEdges(
        pairs.edge[:, flank][:, there], pairs.edge_angle[flank][there], 0.5 * np.pi + np.arctan(tips / pair.base_radius)
    )
    depths = pairs.depth[0, flank][there], pairs.depth[1, flank][there]
    materials = (pair.pinion.material, pair.wheel.material)
    return local_law(
        pairs.curvature[flank][there], depths, materials, edges=edges, held=(bool(pairs.held[0]), bool(pairs.held[1]))
    )
