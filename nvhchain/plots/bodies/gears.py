"""Pictures of gears: their finite element mesh, and the teeth of a pair in contact."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nvhchain.fidelity import GearFidelity
from nvhchain.gear import ContactLines, GearBody, GearPair, VolumeMesh, contact_lines, whole_mesh
from nvhchain.handoff import FloatArray
from nvhchain.plots._style import figure_of, panels, styled
from nvhchain.plots.bodies.scene import Part, View, draw_scene, shell

STEEL, SECOND, CONTACT = "#B9C4CE", "#D8CDB4", "#D55E00"
"""Colours of the first gear, of the second, and of lines of contact."""

LOADED = ("#E69F00", "#F3D06F")
"""Colours of marked teeth of the first gear and of the second."""

_WINDOW = 4.5
"""Half the edge of the close-up (normal modules)."""

_ROOT_HEIGHT = 0.1
"""Height above the root circle from which a face belongs to its tooth (normal modules)."""

_SLICES = 24
"""Points of a line of contact in the picture."""


@styled
def gear_mesh(
    body: GearBody,
    fidelity: GearFidelity,
    *,
    teeth: Collection[int] = (),
    name: str = "",
    view: View = View(azimuth=-0.5),  # noqa: B008 (frozen)
    engine: str = "auto",
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw a gear with its finite element mesh; the blank has the layers of the teeth, of which mesh laws need fewer.

    fidelity: elements; without effect on an imported mesh.
    teeth: teeth to mark, such as those under load.
    engine {"auto", "pyvista", "matplotlib"}: renderer; "auto" is pyvista if it can render off screen, else matplotlib.
    axes: one; that of a new figure by default.
    """
    (ax,) = panels(1, axes, height=7.0, width=8.5)
    mesh = drawn_mesh(body, fidelity)
    draw_scene(ax, [gear_part(body, mesh, teeth=teeth, meshed=True, turn=np.pi / 2)], view=view, engine=engine)
    ax.set_title(f"{name}{': ' if name else ''}{_counted(body, mesh)}", loc="left")
    if teeth:
        ax.legend(handles=[Patch(color=LOADED[0], label=f"teeth {_listed(teeth)}")], loc="lower left")
    return [ax]


@styled
def gear_pair(
    pair: GearPair,
    fidelity: GearFidelity,
    *,
    angle: float = 0.0,
    names: tuple[str, str] = ("pinion", "wheel"),
    view: View = View(elevation=0.3, azimuth=-0.35),  # noqa: B008 (frozen)
    engine: str = "auto",
    axes: Sequence[Axes] | None = None,
) -> list[Axes]:
    """Draw a pair of gears in mesh with their finite elements, teeth in contact marked, and a close-up of them.

    angle: wheel angle (rad).
    axes: two; those of a new figure by default.
    Returns the pair, and the teeth in contact along the shafts.
    """
    drawn = panels(2, axes, columns=2, height=6.0, width=14.0, share="")
    lines = contact_lines(pair, angle, slices=_SLICES)
    bodies, turns = (pair.pinion, pair.wheel), _turns(pair, angle)
    meshes = [drawn_mesh(body, fidelity) for body in bodies]
    parts = [
        gear_part(
            body,
            mesh,
            teeth=_touching_teeth(lines, gear, body),
            meshed=True,
            turn=turns[gear],
            place=np.array([gear * pair.centre_distance, 0.0, body.offset]),
            colour=(STEEL, SECOND)[gear],
            mark=LOADED[gear],
        )
        for gear, (body, mesh) in enumerate(zip(bodies, meshes, strict=True))
    ]
    draw_scene(drawn[0], parts, view=view, engine=engine)
    _close_up(drawn[1], pair, parts, engine)
    axial_view = View(elevation=0.0, azimuth=0.0)
    for line in _lines_of_contact(pair, lines, turns[1]):
        drawn[1].plot(*axial_view.seen(line).T, color=CONTACT, linewidth=3.0, marker="o", markersize=3.0)
    titles = [
        f"{name}: teeth {_listed(_touching_teeth(lines, gear, body))} in contact"
        for gear, (name, body) in enumerate(zip(names, bodies, strict=True))
    ]
    drawn[0].set_title(f"{names[0]} and {names[1]}, wheel angle {np.degrees(angle):.2f}°", loc="left")
    drawn[1].set_title("\n".join(titles), loc="left")
    figure_of(drawn[0]).legend(
        handles=[
            *(Patch(color=colour, label=name) for colour, name in zip((STEEL, SECOND), names, strict=True)),
            *(Patch(color=c, label=f"{name}, in contact") for c, name in zip(LOADED, names, strict=True)),
            Line2D([], [], color=CONTACT, linewidth=3.0, label="line of contact, seen through the teeth"),
        ],
        loc="outside lower center",
        ncols=5,
    )
    return drawn


def gear_part(
    body: GearBody,
    mesh: VolumeMesh,
    *,
    teeth: Collection[int] = (),
    meshed: bool = False,
    turn: float = 0.0,
    place: FloatArray | None = None,
    colour: str = STEEL,
    mark: str = LOADED[0],
) -> Part:
    """Return a gear as a part of a scene, with the edges of its elements or with its outline.

    body, mesh : gear and its undivided mesh.
    teeth : teeth to mark.
    meshed : true for the edges of all elements, False for the outline.
    turn : angle about its axis (rad).
    place : (3,) place of its middle (m).
    colour, mark : colours of the gear and of its marked teeth.
    """
    gear = body.geometry
    surface = shell(len(mesh.nodes), mesh.elements, mesh.kind)
    c, s = np.cos(turn), np.sin(turn)
    nodes = surface.extend_values(mesh.nodes @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
    if place is not None:
        nodes = nodes + place
    colours = np.tile(to_rgb(colour), (len(surface.corners), 1))
    if teeth:
        used = np.where(surface.corners < 0, surface.corners[:, :1], surface.corners)
        x, y, z = np.moveaxis(mesh.nodes[used].mean(axis=1), -1, 0)
        number = np.round((np.arctan2(y, x) - gear.twist * z) / gear.pitch_angle).astype(int) % gear.teeth
        marked = np.isin(number, [tooth % gear.teeth for tooth in teeth])
        marked &= np.hypot(x, y) > gear.root_radius + _ROOT_HEIGHT * gear.normal_module
        colours[marked] = to_rgb(mark)
    return Part(
        nodes[surface.triangles],
        colours[surface.face],
        lines=surface.lines(nodes) if meshed else surface.outline(nodes),
        ink="#404040",
        width=0.8 if meshed else 1.2,
    )


def drawn_mesh(body: GearBody, fidelity: GearFidelity) -> VolumeMesh:
    """Return the imported mesh of a gear, or that of its drawing."""
    return body.blank if isinstance(body.blank, VolumeMesh) else whole_mesh(body, fidelity)


def _turns(pair: GearPair, angle: float) -> tuple[float, float]:
    """Return the angles of tooth 0 of pinion and wheel (rad) where the wheel lies in the direction of x."""
    pinion, wheel = pair.tooth_angles(angle)
    return pinion, np.pi + wheel


def _touching_teeth(lines: ContactLines, gear: int, body: GearBody) -> tuple[int, ...]:
    """Return the teeth of a gear that touch."""
    return tuple(int(tooth) for tooth in np.unique(lines.tooth[gear] % body.geometry.teeth))


def _lines_of_contact(pair: GearPair, lines: ContactLines, turn: float) -> list[FloatArray]:
    """Return the points (n, 3) of the line of contact of every tooth, m, placed by the wheel's flanks."""
    gear = pair.wheel.geometry
    side = 1.0 - 2.0 * lines.side
    radius, tooth = lines.radius[1], lines.tooth[1]
    angle = (
        side * gear.half_tooth_angle(radius)
        + gear.twist * pair.face_positions(lines.axial)[1]
        + tooth * gear.pitch_angle
        + turn
    )
    points = np.column_stack([radius * np.cos(angle) + pair.centre_distance, radius * np.sin(angle), lines.axial])
    return [points[tooth == number] for number in np.unique(tooth)]


def _close_up(ax: Axes, pair: GearPair, parts: Sequence[Part], engine: str) -> None:
    """Draw what lies about the pitch point, along the shafts."""
    half = _WINDOW * pair.wheel.geometry.normal_module
    pitch = np.array([float(pair.base_radius[0]) / np.cos(pair.working_pressure_angle), 0.0])
    near = []
    for part in parts:
        on, kept = (
            (np.abs(shapes[..., :2].mean(axis=1) - pitch) < 2.0 * half).all(axis=1)
            for shapes in (part.triangles, part.lines)
        )
        near.append(replace(part, triangles=part.triangles[on], colours=part.colours[on], lines=part.lines[kept]))
    draw_scene(ax, near, view=View(elevation=0.0, azimuth=0.0), engine=engine, height=2400)
    ax.set_xlim(pitch[0] - half, pitch[0] + half)
    ax.set_ylim(-half, half)


def _counted(body: GearBody, mesh: VolumeMesh) -> str:
    """Return the size of a gear and its mesh in words."""
    kind = {"hex20": "bricks of 20 nodes", "tet10": "tetrahedra of 10 nodes"}[mesh.kind]
    return f"{body.geometry.teeth} teeth, {len(mesh.elements)} {kind}"


def _listed(teeth: Collection[int]) -> str:
    return ", ".join(str(tooth) for tooth in sorted(teeth)) or "none"
