"""gmsh in a process of its own: a STEP part in, its cylinders and its mesh out, in millimetres and the file's frame.

A job is plain data:

- `file`; `dimension`, 2 (flat triangles of the skin) or 3 (quadratic tetrahedra);
- `size` and `smallest` (mm); `per_turn` (elements per full circle);
- `ignore`, the size (mm) below which fillets and faces are removed;
- `lengths` (mm), between which the longest side of the part must lie.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from nvhchain.errors import InputError, SolverError
from nvhchain.fem.mesher import run_mesher, serve
from nvhchain.housing.casting._gmsh import generate

_TIME_LIMIT = 1800.0
"""Time (s) after which the mesher is stopped."""

_OVERLAP = 1e-6
"""Largest volume of overlapping solids over that of all, which is one of rounding."""

_END_SIZE = 2.1
"""Largest size of the end of a small hole or pin over the largest radius of one."""

_SEWN = 1e-2
"""Largest gap (mm) between faces that are sewn into a solid."""

_OTHER_SHAPES = ("Plane", "Cone", "Sphere", "Torus")

_BROKEN = "StepReaderData"
"""Word of OpenCASCADE's reader in its last message on a damaged file, after which it may crash."""

_NARROW = (0.4, 0.2)
"""Factors on the smallest element that are tried where faces of small holes cross each other."""

_SAMPLES, _ROUND = 9, 2e-3
"""Samples each way over a spline, and the largest distance (mm) of one from the cylinder that it counts as."""


def mesh(job: dict[str, Any]) -> dict[str, np.ndarray]:
    """Mesh a part.

    Returns `nodes` (n, 3) mm and `elements`, (m, 10) in VTK order or (m, 3) seen from outside. `face` (m,) is the
    number of the face of each triangle. `members` (j, 2) are pairs of face and node. Each row of `cylinders` (c, 12)
    starts with face, centre (3), axis (3), radius, and lower and upper place along the axis. It ends with the angle
    (rad), and 1 for a hole or −1 for a shaft. `volume`, `area` and `centre` of mass follow, then `solids`, `removed`,
    the number of removed faces, and `notes`. A part outside `lengths` has only its `box` (2, 3) mm.

    Raises InputError for a part that is no closed body, SolverError with gmsh's message if it cannot mesh.
    """
    try:
        made = run_mesher(
            "nvhchain.housing.cad._gmsh",
            json.dumps(job).encode(),
            time_limit=_TIME_LIMIT,
            failure=f"{job['file']}: gmsh could not mesh the part",
            remedy="use another element size, remove the fillets in the CAD program, or raise smallest_feature",
        )
    except SolverError as error:
        if _BROKEN not in str(error):
            raise
        said = str(error).split(_BROKEN)[1].partition(";")[0].strip(" :*")
        raise InputError(
            f"{job['file']}: it cannot be read as STEP ({said}): export it again as AP214 or AP242"
        ) from None
    if "refused" in made:
        raise InputError(f"{job['file']}: {made['refused']}")
    return made


class _Refused(Exception):
    """A part that is no closed body; its message has the remedy."""


def _served(job: bytes) -> dict[str, Any]:
    """Run inside the child process."""
    try:
        return _meshed(json.loads(job))
    except _Refused as error:
        return {"refused": str(error)}


def _meshed(job: dict[str, Any]) -> dict[str, Any]:
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    for name, value in {
        "General.Terminal": 0,
        "General.NumThreads": 1,
        "Mesh.RandomSeed": 1,
        "Mesh.MeshSizeMax": job["size"],
        "Mesh.MeshSizeMin": job["smallest"],
        "Mesh.MeshSizeFromCurvature": job["per_turn"],
        "Mesh.MeshSizeExtendFromBoundary": 1,
        "Mesh.Algorithm": 6,
        "Mesh.Algorithm3D": 1,
        "Mesh.Optimize": 1,
        "Mesh.MinimumCircleNodes": 4,
        "Mesh.MinimumCurveNodes": 2,
    }.items():
        gmsh.option.setNumber(name, value)
    notes: list[str] = []
    solids = _bonded(gmsh, _solids(gmsh, job["file"], notes), notes)
    box = np.array(gmsh.model.getBoundingBox(-1, -1)).reshape(2, 3)
    if not job["lengths"][0] <= float(np.ptp(box, axis=0).max()) <= job["lengths"][1]:
        gmsh.finalize()
        return {"box": box}
    solids, removed = _simplified(gmsh, solids, job["file"], job["ignore"], notes)
    found = _measured(gmsh, solids)
    for tag in solids:
        gmsh.model.mesh.setOutwardOrientation(tag)
    gmsh.model.mesh.generate(2)
    skin = _triangles(gmsh)
    _check_closed(skin)
    found |= {"cylinders": _cylinders(gmsh, skin), "removed": removed, "notes": np.array(notes, dtype=str)}
    if job["dimension"] == 2:
        outer = skin["face"] > 0
        found |= {"nodes": skin["nodes"], "elements": skin["elements"][outer], "face": skin["face"][outer]}
        found["members"] = _pairs(found["face"], found["elements"])
    else:
        generate(gmsh, 3, job["size"], job["smallest"], _NARROW)
        gmsh.model.mesh.setOrder(2)
        found |= _tetrahedra(gmsh)
    gmsh.finalize()
    return found


def _solids(gmsh: Any, file: str, notes: list[str]) -> list[int]:
    """Read the solids; faces without a solid are sewn into one."""
    occ = gmsh.model.occ
    try:
        parts = occ.importShapes(file, highestDimOnly=True, format="step")
    except Exception as error:  # gmsh has no class for a file that it cannot read
        raise _Refused(f"it cannot be read as STEP ({error}): export it again as AP214 or AP242") from None
    if not parts:
        raise _Refused("it holds no shape: export the solid itself, as AP214 or AP242")
    if all(dimension == 3 for dimension, _ in parts):
        return [tag for _, tag in parts]
    faces = sum(dimension == 2 for dimension, _ in parts)
    sewn = occ.healShapes([], tolerance=_SEWN, sewFaces=True, makeSolids=True)  # all together
    solids = [tag for dimension, tag in sewn if dimension == 3]
    if not solids:
        occ.synchronize()
        raise _Refused(
            f"it holds {faces} faces and no solid, and they do not close within {_SEWN:g} mm{_open_place(gmsh)}: "
            "export a solid, or close its surface in the CAD program"
        )
    notes.append(f"its {faces} faces were sewn into {len(solids)} solid" + "s" * (len(solids) > 1))
    return solids


def _open_place(gmsh: Any) -> str:
    """Return words for the first edge of the sewn faces that only one face has; empty if there is none."""
    owners: dict[int, int] = {}
    for _, face in gmsh.model.getEntities(2):
        for _, edge in gmsh.model.getBoundary([(2, face)], combined=False, oriented=False):  # a seam comes twice
            owners[edge] = owners.get(edge, 0) + 1
    for edge, count in owners.items():
        box = np.array(gmsh.model.getBoundingBox(1, edge)).reshape(2, 3)
        if count == 1 and _length(gmsh, edge) > _SEWN:  # the tip of a cone is an edge, too
            return f" (open edge at {_words(np.round(box.mean(axis=0), 2) + 0.0)} mm)"
    return ""


def _words(place: Any) -> str:
    return "[" + ", ".join(f"{value:.4g}" for value in place) + "]"


def _bonded(gmsh: Any, solids: list[int], notes: list[str]) -> list[int]:
    """Join solids where they touch, so that they share faces; refuse solids that touch nothing.

    Where solids overlap, the material counts once; a note states the share.
    """
    occ = gmsh.model.occ
    if len(solids) > 1:
        apart = sum(occ.getMass(3, tag) for tag in solids)
        pieces, _ = occ.fragment([(3, tag) for tag in solids], [])
        solids = [tag for dimension, tag in pieces if dimension == 3]
        twice = apart - sum(occ.getMass(3, tag) for tag in solids)
        if twice > _OVERLAP * apart:
            share = f"{100 * twice / apart:.2g} % of their volume"
            notes.append(f"solids overlap by {share}, which counts once: correct the part if they should not")
    occ.synchronize()
    owners: dict[int, list[int]] = {}
    for tag in solids:
        for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False):
            owners.setdefault(face, []).append(tag)
    reached, waiting = {solids[0]}, [solids[0]]
    while waiting:
        current = waiting.pop()
        for both in owners.values():
            if current in both:
                waiting += [other for other in both if other not in reached]
                reached.update(both)
    apart = [tag for tag in solids if tag not in reached]
    if apart:
        raise _Refused(
            f"its {len(solids)} solids do not hang together: the one at {_words(occ.getCenterOfMass(3, apart[0]))} mm "
            "touches none of the others: leave it out, or close the gap in the CAD program"
        )
    return solids


def _simplified(gmsh: Any, solids: list[int], file: str, ignore: float, notes: list[str]) -> tuple[list[int], int]:
    """Remove fillets and faces smaller than `ignore` (mm); those that OpenCASCADE cannot remove stay."""
    small = _small_faces(gmsh, ignore) if ignore > 0 else []
    if not small:
        return solids, 0
    if len(solids) > 1:
        notes.append(f"{len(small)} faces smaller than {ignore:g} mm stay: they are removed from a single solid only")
        return solids, 0
    occ = gmsh.model.occ
    volume = occ.getMass(3, solids[0])
    try:
        made = occ.defeature([solids[0]], small, removeVolume=False)
        kept = [tag for dimension, tag in made if dimension == 3]
        if len(kept) != 1 or kept == solids or abs(occ.getMass(3, kept[0]) / volume - 1) > 0.02:
            raise RuntimeError("another body")
    except Exception:  # gmsh has no class for a failed operation
        notes.append(f"{len(small)} faces smaller than {ignore:g} mm stay: OpenCASCADE cannot remove them together")
        gmsh.clear()  # the failed operation may have taken the solid
        return _bonded(gmsh, _solids(gmsh, file, []), []), 0
    occ.remove([(3, solids[0])], recursive=True)
    occ.synchronize()
    return kept, len(small)


def _small_faces(gmsh: Any, ignore: float) -> list[int]:
    """Return the fillets with a radius below `ignore` (mm) and the faces that fit into a ball of this diameter."""
    small = []
    for dimension, tag in gmsh.model.getEntities(2):
        kind = gmsh.model.getType(dimension, tag)
        reals = gmsh.model.getEntityProperties(dimension, tag)[1]
        radius = {"Cylinder": 6, "Torus": 7, "Sphere": 3}.get(kind)
        corners = np.array(gmsh.model.getBoundingBox(dimension, tag)).reshape(2, 3)
        round_and_small = radius is not None and len(reals) > radius and reals[radius] < ignore
        if round_and_small or np.linalg.norm(corners[1] - corners[0]) < ignore:
            small.append(tag)
    return small + _ends(gmsh, small, ignore)


def _ends(gmsh: Any, small: list[int], ignore: float) -> list[int]:
    """Return the bottoms of blind holes and tops of pins among `small`: faces within one circle of a small cylinder."""
    round_ones = {tag for tag in small if gmsh.model.getType(2, tag) == "Cylinder"}
    found = []
    for _, tag in gmsh.model.getEntities(2):
        edges = [edge for _, edge in gmsh.model.getBoundary([(2, tag)], combined=False, oriented=False)]
        alone = [edge for edge in edges if edges.count(edge) == 1 and _length(gmsh, edge) > _SEWN]
        if tag in small or _length(gmsh, tag, 2) > _END_SIZE * ignore:
            continue
        if len(alone) == 1 and round_ones.intersection(gmsh.model.getAdjacencies(1, alone[0])[0]):
            found.append(tag)
    return found


def _length(gmsh: Any, tag: int, dimension: int = 1) -> float:
    """Return the longest side (mm) of the box around an edge or a face."""
    return float(np.ptp(np.array(gmsh.model.getBoundingBox(dimension, tag)).reshape(2, 3), axis=0).max())


def _measured(gmsh: Any, solids: list[int]) -> dict[str, Any]:
    """Return volume, area and centre of mass of the body by OpenCASCADE."""
    occ = gmsh.model.occ
    volumes = np.array([occ.getMass(3, tag) for tag in solids])
    centres = np.array([occ.getCenterOfMass(3, tag) for tag in solids])
    outside = gmsh.model.getBoundary([(3, tag) for tag in solids], combined=True, oriented=False)
    return {
        "volume": volumes.sum(),
        "centre": volumes @ centres / volumes.sum(),
        "area": sum(occ.getMass(2, tag) for _, tag in outside),
        "solids": len(solids),
    }


def _triangles(gmsh: Any) -> dict[str, np.ndarray]:
    """Return nodes, triangles and the face of each; 0 for faces between two solids."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    elements, owner = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for _, face in gmsh.model.getEntities(2):
        _, number = gmsh.model.mesh.getElementsByType(2, face)
        shared = len(gmsh.model.getAdjacencies(2, face)[0]) > 1
        elements.append(order[np.searchsorted(tags, number, sorter=order)].reshape(-1, 3))
        owner.append(np.full(len(elements[-1]), 0 if shared else face))
    return {
        "nodes": coordinates.reshape(-1, 3),
        "elements": np.concatenate(elements),
        "face": np.concatenate(owner),
    }


def _check_closed(skin: dict[str, np.ndarray]) -> None:
    """Refuse a skin with an edge at one triangle."""
    edges = np.sort(skin["elements"][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs, count = np.unique(edges, axis=0, return_counts=True)
    single = pairs[count == 1]
    if not len(pairs) or len(single):
        place = f" (first at {_words(skin['nodes'][single[0]].mean(axis=0))} mm)" if len(single) else ""
        raise _Refused(
            f"its skin is open along {len(single)} edges{place}: close the solid in the CAD program and export it again"
        )


def _cylinders(gmsh: Any, skin: dict[str, np.ndarray]) -> np.ndarray:
    """Return the table of the outer cylindrical faces; splines that are cylinders count, too."""
    rows: list[Sequence[float]] = []
    for _, tag in gmsh.model.getEntities(2):
        on = skin["elements"][skin["face"] == tag]
        kind = gmsh.model.getType(2, tag)
        if not len(on) or kind in _OTHER_SHAPES:
            continue
        if kind == "Cylinder":
            shape = np.array(gmsh.model.getEntityProperties(2, tag)[1][:7])
            (turn, low), (end, high) = gmsh.model.getParametrizationBounds(2, tag)
            angle = end - turn
        else:
            fitted = _fitted(gmsh, tag)
            if fitted is None:
                continue
            shape = fitted
            low, high, angle = _reach(shape, skin["nodes"][on])
        centre, axis = shape[:3], shape[3:6]
        corners = skin["nodes"][on]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        away = corners.mean(axis=1) - centre
        away -= np.outer(away @ axis, axis)
        hole = 1.0 if float(np.einsum("ka,ka->", normal, away)) < 0 else -1.0
        rows.append([tag, *shape, low, high, angle, hole])
    return np.array(rows).reshape(-1, 12)


def _fitted(gmsh: Any, tag: int) -> np.ndarray | None:
    """Return centre, axis and radius of a spline that is a cylinder; None for any other."""
    low, high = gmsh.model.getParametrizationBounds(2, tag)
    u, v = (np.linspace(a, b, _SAMPLES) for a, b in zip(low, high, strict=True))
    parameters = np.stack(np.meshgrid(u, v), axis=-1).ravel()
    points = np.array(gmsh.model.getValue(2, tag, parameters)).reshape(-1, 3)
    normals = np.array(gmsh.model.getNormal(tag, parameters)).reshape(-1, 3)
    _, turned, axes = np.linalg.svd(normals, full_matrices=False)
    if turned[1] < 1e-2 * turned[0] or turned[2] > 1e-4 * turned[0]:
        return None
    transverse, axis = axes[:2], axes[2]
    flat = points @ transverse.T
    # x² + y² = 2 c·(x, y) + (r² − c²)
    solved = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), (flat**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(solved[2] + solved[:2] @ solved[:2], 0.0)))
    if np.abs(np.linalg.norm(flat - solved[:2], axis=1) - radius).max() > _ROUND:
        return None
    return np.array([*(solved[:2] @ transverse), *axis, radius])


def _reach(shape: np.ndarray, corners: np.ndarray) -> tuple[float, float, float]:
    """Return the ends along the axis and the covered angle of triangles (k, 3, 3) on a cylinder."""
    axis = shape[3:6]
    away = corners.reshape(-1, 3) - shape[:3]
    axial = away @ axis
    first = away[0] - axial[0] * axis
    turn = np.sort(np.arctan2(away @ np.cross(axis, first), away @ first))
    gap = max(float(np.diff(turn).max()), float(turn[0] + 2 * np.pi - turn[-1]))
    edge = float(np.median(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1))) / float(np.linalg.norm(first))
    return float(axial.min()), float(axial.max()), 2 * np.pi if gap < 3 * edge else 2 * np.pi - gap


def _tetrahedra(gmsh: Any) -> dict[str, Any]:
    """Return nodes, elements and the nodes of every face."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, number = gmsh.model.mesh.getElementsByType(11)
    elements = number.reshape(-1, 10)[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]  # gmsh numbers the last two the other way
    used = np.unique(elements)
    order = np.argsort(tags)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    members = []
    for _, face in gmsh.model.getEntities(2):
        _, corners = gmsh.model.mesh.getElementsByType(9, face)
        own = np.unique(corners)
        members.append(np.column_stack([np.full(len(own), face), np.searchsorted(used, own)]))
    return {
        "nodes": coordinates.reshape(-1, 3)[rows],
        "elements": np.searchsorted(used, elements),
        "members": np.concatenate(members).astype(np.int64),
    }


def _pairs(face: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return pairs of face and node."""
    return np.unique(np.column_stack([np.repeat(face, 3), triangles.ravel()]), axis=0)


if __name__ == "__main__":
    serve(_served)
