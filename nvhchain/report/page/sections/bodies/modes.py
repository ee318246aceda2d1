"""Modes of the gearbox and of its housing: they move; Campbell diagram and table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nvhchain.handoff import ComplexArray, FloatArray, ReducedHousing, Surface, SurfaceVelocity
from nvhchain.report.page.blocks import Figure, Table, colour, grid, label, panel, upright
from nvhchain.report.page.moving import Colours, MovingBody, moving_bodies
from nvhchain.report.stored import Stored, StoredRun, rounded

TITLE = "Modes"

LEAST_SHARE = 0.02
"""Share of the meshes in the strain energy above which a mode is drawn strongly."""

MOST = 2
"""Largest number of gearboxes and of housings that move: browsers draw few bodies at once."""

SHAFT_POINTS = 24
"""Points around a shaft."""

SIZE = [Colours("Motion", "of the largest", "size")]
"""Colours of modes."""


def blocks(stored: Stored) -> list[Any]:
    """Return Campbell diagrams, moving modes of each gearbox, and those of each housing."""
    recorded = stored.having(lambda run: run.record("modes.json"))
    housings = _housings(stored)
    found: list[Any] = [_campbell(stored, recorded)] if recorded else []
    for _, run, record in recorded[:MOST]:
        found += [_gearbox(run, record, housings.get(run.name)), _table(run, record)]
    seen: dict[str, list[str]] = {}
    unique: dict[str, ReducedHousing] = {}
    for name, housing in housings.items():
        seen.setdefault(housing.content_hash, []).append(name)
        unique[housing.content_hash] = housing
    alone = [
        (" and ".join(seen[key]), reduced.drop_ritz_vectors()) for key, reduced in unique.items() if reduced.mode_count
    ]
    return found + [_housing(names, reduced) for names, reduced in alone[:MOST]]


def _housings(stored: Stored) -> dict[str, ReducedHousing]:
    """Return configuration → its reduced housing."""
    found: dict[str, ReducedHousing] = {}
    for run in stored.runs:
        velocity = run.hand_off("surface_velocity", SurfaceVelocity)
        surface = "" if velocity is None else velocity.surface.content_hash
        named = stored.housing(run)
        own = stored.radiating(ReducedHousing, surface) if surface and named is None else [named]
        if len(own) == 1 and own[0] is not None:
            found[run.name] = own[0]
    return found


def _campbell(stored: Stored, recorded: Sequence[tuple[int, StoredRun, Mapping[str, Any]]]) -> Figure:
    """Return natural frequencies over speed, with the mesh orders as rays."""
    layout = grid([run.name for _, run, _ in recorded], min(2, len(recorded)), "input speed / rpm", "frequency / Hz")
    layout["showlegend"] = False
    traces: list[dict[str, Any]] = []
    for place, (number, run, record) in enumerate(recorded):
        end = str(place + 1) if place else ""
        top = max((max(row) for row in record["over_speed_Hz"] if row), default=1.0)
        fastest = max(record["speed_rpm"])
        on = panel(place)
        for order, names in _rays(record["orders"], 60.0 * top / fastest):
            reach = min(fastest, 60.0 * top / order)
            traces.append(
                {
                    "type": "scatter", "mode": "lines+text", "x": rounded([0.0, reach]),
                    "y": rounded([0.0, order * reach / 60.0]), "text": ["", f"\u2002{label(names)}"],
                    "textposition": "middle right", "textfont": {"size": 10, "color": "#59636e"},
                    "line": {"color": "#8a929b", "width": 1, "dash": "dot"}, "hoverinfo": "skip", **on,
                }
            )  # fmt: skip
        points = [
            (speed, f, share)
            for speed, row, shares in zip(
                record["speed_rpm"], record["over_speed_Hz"], record["over_speed_mesh_share"], strict=True
            )
            for f, share in zip(row, shares, strict=True)
        ]
        for strong in (False, True):
            chosen = [point for point in points if (point[2] >= LEAST_SHARE) is strong]
            traces.append(
                {
                    "type": "scatter", "mode": "markers",
                    "x": rounded(point[0] for point in chosen), "y": rounded(point[1] for point in chosen),
                    "customdata": rounded((100 * point[2] for point in chosen), 1),
                    "marker": {"size": 6 if strong else 3, "color": colour(number) if strong else "#b4bac1"},
                    "hovertemplate": "%{y:.0f} Hz at %{x:.0f} rpm: meshes hold %{customdata} % of the strain"
                    "<extra>" + label(run.name) + "</extra>",
                    **on,
                }
            )  # fmt: skip
        layout[f"xaxis{end}"]["range"], layout[f"yaxis{end}"]["range"] = [0.0, 1.35 * fastest], [0.0, 1.05 * top]
        where = {"xref": f"x{end}", "yref": f"y{end} domain"}
        layout.setdefault("shapes", []).append(upright(record["nominal_rpm"], "dash", **where))
    caption = (
        "Campbell diagram: modes under load; large where the meshes hold 2 % of the strain energy or more. Rays: mesh "
        "orders. Dashed: the speed of the case."
    )
    return Figure(caption, traces, layout, height=400)


def _rays(orders: Mapping[str, float], steepest: float) -> list[tuple[float, str]]:
    """Return rising orders with the names at their ends; rays that end close together are named at the first."""
    found: list[tuple[float, str]] = []
    last = 0.0
    for name, order in sorted(orders.items(), key=lambda item: item[1]):
        if found and min(order, steepest) - last < 0.05 * steepest:
            last_named = max(number for number, (_, names) in enumerate(found) if names)
            found[last_named] = (found[last_named][0], f"{found[last_named][1]}, {name}")
            found.append((order, ""))
        else:
            last = min(order, steepest)
            found.append((order, name))
    return found


def _table(run: StoredRun, record: Mapping[str, Any]) -> Table:
    rows = [
        (f"{f:.1f}", f"{100 * damping:.2f}", _largest(record["strain"], i), _largest(record["kinetic"], i))
        for i, (f, damping) in enumerate(zip(record["frequency_Hz"], record["damping"], strict=True))
    ]
    head = ("frequency / Hz", "damping / %", "strain energy", "kinetic energy")
    return Table(head, rows, f"{run.name}: {len(rows)} modes under {record['input_torque_Nm']:g} N m", True, 9)


def _largest(shares: Mapping[str, list[float]], mode: int) -> str:
    most = sorted(shares, key=lambda part: -shares[part][mode])[:3]
    return ", ".join(f"{part} {100 * shares[part][mode]:.0f} %" for part in most if shares[part][mode] >= 0.01)


def _gearbox(run: StoredRun, record: Mapping[str, Any], housing: ReducedHousing | None) -> Figure:
    """Return the moving modes of shafts and gears, with those of the housing beside them."""
    plane_motion, housing_motion = (_complex(record[name]) for name in ("plane_motion", "housing_motion"))
    surface, motion = _train(record, plane_motion)
    bodies = [MovingBody(f"{run.name}: shafts and gears", surface, motion)]
    if housing is not None and housing_motion.shape[1] == len(housing.normal_shapes):
        moved: ComplexArray = np.asarray(housing_motion @ housing.normal_shapes, dtype=complex)
        bodies.append(MovingBody(f"{run.name}: housing", housing.surface, moved))
    texts = [
        f"{f:.1f} Hz, damping {100 * damping:.2f} %: strain {_largest(record['strain'], i)}"
        for i, (f, damping) in enumerate(zip(record["frequency_Hz"], record["damping"], strict=True))
    ]
    meshes = sum(np.array(shares) for part, shares in record["strain"].items() if part.startswith("mesh "))
    chosen = int(np.argmax(meshes)) if np.ndim(meshes) else 0
    caption = (
        f"{run.name}: modes of the gearbox under load. It starts at the mode whose meshes hold most of the strain "
        "energy. Shafts, gears and housing move in one scale; the housing moves along its normals."
    )
    return moving_bodies(bodies, texts, SIZE, caption, chosen=chosen, what="mode")


def _housing(names: str, housing: ReducedHousing) -> Figure:
    texts = [
        f"mode {i}: {f:.1f} Hz, damping {100 * damping:.2f} %"
        for i, (f, damping) in enumerate(zip(housing.natural_frequency, housing.modal_damping, strict=True), start=1)
    ]
    body = MovingBody(names, housing.surface, np.asarray(housing.normal_shapes, dtype=complex))
    first = min(int((housing.natural_frequency == 0).sum()), len(texts) - 1)
    return moving_bodies([body], texts, SIZE, "Modes of the housing alone.", chosen=first, what="mode")


def _complex(parts: Mapping[str, Any]) -> ComplexArray:
    return (np.array(parts["real"]) + 1j * np.array(parts["imag"])).reshape(parts["shape"])


def _train(record: Mapping[str, Any], plane_motion: ComplexArray) -> tuple[Surface, ComplexArray]:
    """Return shafts and gears as one surface, and the motion (n_mode, n_vertex, 3) of its vertices."""
    vertices, triangles, motions = [], [], []
    count = 0
    for cylinder in record["cylinders"]:
        points, faces = _cylinder(cylinder)
        vertices.append(points)
        triangles.append(faces + count)
        motions.append(_carried(points, cylinder, record["planes"], plane_motion))
        count += len(points)
    surface = Surface(np.concatenate(vertices), np.concatenate(triangles))
    return surface, np.concatenate(motions, axis=1)


def _cylinder(cylinder: Mapping[str, Any]) -> tuple[FloatArray, FloatArray]:
    """Return vertices and triangles of a closed cylinder; that of a gear has teeth."""
    (inner, outer), (start, end) = cylinder["radii"], cylinder["ends"]
    count = 4 * cylinder["teeth"] or SHAFT_POINTS
    angle = 2 * np.pi * np.arange(count) / count
    radius = np.where(np.arange(count) % 4 < 2, outer, inner) if cylinder["teeth"] else np.full(count, outer)
    ring = np.stack(
        [cylinder["axis"][0] + radius * np.cos(angle), cylinder["axis"][1] + radius * np.sin(angle)], axis=1
    )
    points = np.concatenate(
        [np.column_stack([ring, np.full(count, z)]) for z in (start, end)]
        + [[[*cylinder["axis"], z]] for z in (start, end)]
    )
    here, after = np.arange(count), (np.arange(count) + 1) % count
    side = [np.stack(part, axis=1) for part in ((here, after, after + count), (here, after + count, here + count))]
    caps = [
        np.stack([after, here, np.full(count, 2 * count)], axis=1),
        np.stack([here + count, after + count, np.full(count, 2 * count + 1)], axis=1),
    ]
    return points, np.concatenate([*side, *caps])


def _carried(
    points: FloatArray, cylinder: Mapping[str, Any], planes: list[Mapping[str, Any]], motion: ComplexArray
) -> ComplexArray:
    """Return the motion (n_mode, n, 3) of points that neighbouring cross-sections carry as rigid bodies."""
    own = sorted(
        {plane["z"]: i for i, plane in enumerate(planes) if plane["rotor"] == cylinder["rotor"]}.items()
    )  # z, index
    places = np.array([z for z, _ in own])
    each = []
    for z, i in own:
        arm = points - np.array([*cylinder["axis"], z])
        each.append(motion[:, None, i, :3] + np.cross(motion[:, None, i, 3:], arm[None]))
    weight = np.array([np.interp(points[:, 2], places, row) for row in np.eye(len(own))])
    return np.einsum("pn,pmnk->mnk", weight, np.array(each))
