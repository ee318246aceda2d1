"""Deflections beyond the tabulated range of a mesh law, where its end slopes continue unchecked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nvhchain.dynamics.model.gearbox import Gearbox
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray, ForceAccuracy, MeshLaw
from nvhchain.handoff.declared import Label


def excursions(
    gearbox: Gearbox, mesh_laws: Sequence[MeshLaw], drive: FloatArray, back: FloatArray, fidelity: DynamicsFidelity
) -> ForceAccuracy:
    """State the meshes whose flanks carry beyond the table; none at the level `contact`, which uses no table.

    drive, back : (n, n_mesh) deflections (m) of drive and back flanks, with the sign of the laws.

    The two differ because the flank normals differ and the shafts move apart under load. Each flank counts on the side
    to which it is pressed. It counts on the other side too where the law still pushes, or pulls, at its end.
    """
    found: dict[str, tuple[float, float, float, float]] = {}
    if fidelity.mesh_level == "contact":
        return ForceAccuracy()
    for mesh, law, front, behind in zip(gearbox.meshes, mesh_laws, drive.T, back.T, strict=True):
        lowest, highest = float(behind.min()), float(front.max())
        if law.force[:, 0].max() > 0.0:
            lowest = min(lowest, float(front.min()))
        if law.force[:, -1].min() < 0.0:
            highest = max(highest, float(behind.max()))
        low, high = float(law.deflection[0]), float(law.deflection[-1])
        if lowest < low or highest > high:
            found[f"{mesh.pinion_shaft}–{mesh.wheel_shaft}"] = lowest, highest, low, high
    return _deflection_fields(found)


def _deflection_fields(found: Mapping[str, Sequence[float]]) -> ForceAccuracy:
    """State lowest and highest deflection and the ends of the table (m) by mesh."""
    if not found:
        return ForceAccuracy()
    lowest, highest, low, high = np.array(list(found.values())).T
    return ForceAccuracy(tuple(map(Label, found)), lowest, highest, low, high)


def joined(parts: Sequence[ForceAccuracy]) -> ForceAccuracy:
    """Return the accuracy of one record from those of its pieces: extremes of deflections, sums of times."""
    beyond: dict[str, list[float]] = {}
    seconds: dict[str, float] = {}
    whole = ForceAccuracy()
    for part in parts:
        whole |= part
        ends = (part.lowest_deflection, part.highest_deflection, part.table_lowest, part.table_highest)
        rows = (() if end is None else end.tolist() for end in ends)
        for mesh, *of in zip(part.law_exceeded or (), *rows, strict=True):
            lowest, highest, low, high = of
            before = beyond.get(mesh, of)
            beyond[mesh] = [min(before[0], lowest), max(before[1], highest), low, high]
        for mesh, time in zip(part.parted or (), () if part.parted_time is None else part.parted_time, strict=True):
            seconds[mesh] = seconds.get(mesh, 0.0) + float(time)
    whole |= _deflection_fields(beyond)
    if seconds:
        whole |= ForceAccuracy(parted=tuple(map(Label, seconds)), parted_time=np.array(list(seconds.values())))
    return whole
