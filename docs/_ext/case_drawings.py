"""Directive `case-drawing`: pictures of case fields with their dimensions, drawn from the program's own shapes."""

import base64
import io

import numpy as np
from docutils import nodes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.path import Path
from sphinx.util.docutils import SphinxDirective

from nvhchain import load_case
from nvhchain.cli.examples import examples_folder
from nvhchain.gear.drawing.blank import Holes, Slots, ThinRim
from nvhchain.gear.drawing.micro_geometry import Flank, Relief
from nvhchain.housing.casting.solids import bolt_circle, casting_recipe, outline_at

MM, UM = 1e3, 1e6
METAL, EDGE, SIZE = "#c9d3dc", "#33414d", "#b3261e"


def example():
    return load_case(examples_folder() / "small" / "single_stage.toml")


def dimension(ax, start, end, text, *, at=(0, 4), ha="center"):
    """Arrow between two points with a field's name beside its middle."""
    ax.annotate("", start, end, arrowprops={"arrowstyle": "<->", "color": SIZE, "lw": 1, "shrinkA": 0, "shrinkB": 0})
    middle = np.mean([start, end], axis=0)
    ax.annotate(text, middle, at, textcoords="offset points", ha=ha, va="center", color=SIZE, fontsize=8)


def pointer(ax, place, text, away, ha="center"):
    """Field's name with a line to what it describes."""
    line = {"arrowstyle": "-", "color": SIZE, "lw": 0.8}
    ax.annotate(
        text, place, away, textcoords="offset points", ha=ha, va="center", color=SIZE, fontsize=8, arrowprops=line
    )


def inside(solid, x, z):
    """Whether points of the plane y = 0 lie in a solid of the casting's recipe."""
    if solid["kind"] == "cylinder":
        (cx, cy, low), height = solid["base"], solid["axis"][2]
        return (np.hypot(x - cx, cy) <= solid["radius"]) & (z >= low) & (z <= low + height)
    if solid["kind"] == "plate":
        low, border = solid["polygon"][0][2], Path([corner[:2] for corner in solid["polygon"]])
        across = border.contains_points(np.column_stack([x[0], 0 * x[0]]))
        upright = solid["extrude"][2] > 0 and np.ptp([corner[2] for corner in solid["polygon"]]) == 0
        return upright & across[None, :] & (z >= low) & (z <= low + solid["extrude"][2])
    heights = [section["z"] for section in solid["sections"]]
    left, right = (
        [pick(arc[0] + sign * arc[2] for arc in section["arcs"]) for section in solid["sections"]]
        for pick, sign in ((min, -1), (max, 1))
    )
    within = (x >= np.interp(z, heights, left)) & (x <= np.interp(z, heights, right))
    return within & (z >= heights[0]) & (z <= heights[-1])


def casting(figure):
    """Section through the shafts, and view from the mounting plane."""
    body = example().housing
    x, z = np.meshgrid(np.linspace(-0.08, 0.16, 1400), np.linspace(-0.012, 0.16, 1000))
    metal = np.zeros(x.shape, bool)
    for step in casting_recipe(body, 0.01, 8)["steps"]:
        part = np.any([inside(solid, x, z) for solid in step["solids"]], axis=0)
        metal = metal | part if step["op"] == "fuse" else metal & ~part
    ax, view = figure.subplots(2, 1, height_ratios=(1, 1.1))
    ax.contourf(MM * x, MM * z, metal.astype(float), levels=[0.5, 1.5], colors=[METAL])
    ax.contour(MM * x, MM * z, metal.astype(float), levels=[0.5], colors=EDGE, linewidths=0.8)
    right = MM * max(space.centre[0] + space.radius for space in body.gear_spaces)
    depth, bell, wall, end = (MM * v for v in (body.depth, body.bell_depth, body.wall, body.end_wall))
    dimension(ax, (-72, 0), (-72, depth), "depth", at=(-4, 0), ha="right")
    dimension(ax, (34, 0), (34, bell), "bell_depth", at=(4, 0), ha="left")
    pointer(ax, (34, bell + end / 2), "end_wall", (0, 24))
    pointer(ax, (34, depth - end / 2), "end_wall", (0, 46))
    pointer(ax, (right + wall / 2 + 2, 70), "wall", (34, 0), "left")
    pointer(ax, (right + MM * body.draft, 20), "draft: growth\ntowards the flange", (26, 22), "left")
    pointer(ax, (right + wall - 3, depth - 4), "chamfer", (26, 14), "left")
    flange = right + wall + MM * (body.draft + body.flange_width)
    pointer(ax, (flange - 4, MM * body.flange_thickness / 2), "flange_width,\nflange_thickness", (16, 6), "left")
    bore = next(one for one in body.bores if one.centre[2] > body.depth / 2)
    cx, cz, radius = MM * bore.centre[0], MM * bore.centre[2], MM * bore.radius
    dimension(ax, (cx, cz), (cx + radius, cz), "radius", at=(0, -6))
    ax.plot(cx, cz, "+", color=SIZE)
    pointer(ax, (cx, cz), "bores: centre", (-12, -34), "right")
    pointer(ax, (cx - radius - 4, cz), "boss_thickness", (-26, 14), "right")
    pointer(ax, (cx, MM * (bore.centre[2]) + 14), "cover_thickness", (-10, 20))
    ax.axhline(0, color=EDGE, lw=0.8, ls="-.")
    ax.text(-78, -6, "mounting plane z = 0", fontsize=8, va="center")
    ax.set(xlabel="x / mm", ylabel="z / mm", title="Section y = 0", aspect="equal", xlim=(-110, 230), ylim=(-14, 170))

    foot = body.wall + body.draft + body.flange_width
    for offset, name, away in (
        (0.0, "gear_spaces: their hull", (50, -72)),
        (body.wall, "wall", (-30, 42)),
        (foot, "flange", (40, 36)),
    ):
        points = np.concatenate(
            [
                np.column_stack([a.x + a.radius * np.cos(t), a.y + a.radius * np.sin(t)])
                for a in outline_at(body, offset)
                for t in [np.linspace(a.start, a.end, 90)]
            ]
        )
        closed = MM * np.vstack([points, points[:1]])
        view.plot(*closed.T, color=EDGE, lw=1)
        at = {0.0: closed[:, 1].argmin(), foot: closed[:, 0].argmax()}.get(offset, len(closed) // 5)
        pointer(view, closed[at], name, away)
    for space in body.gear_spaces:
        view.add_patch(Circle(MM * np.array(space.centre), MM * space.radius, fill=False, ls="--", ec=EDGE, lw=0.8))
    for one in body.bores:
        view.add_patch(Circle(MM * np.array(one.centre[:2]), MM * one.radius, fill=True, fc="white", ec=EDGE, lw=0.8))
    for point in bolt_circle(body):
        for radius, fill in ((body.lug_radius, METAL), (body.bolt_radius, "white")):
            view.add_patch(Circle(MM * point, MM * radius, fc=fill, ec=EDGE, lw=0.8))
    last = MM * bolt_circle(body)[0]
    pointer(view, last, f"bolts = {body.bolts},\nbolt_radius, lug_radius", (-30, 30))
    view.set(
        xlabel="x / mm",
        ylabel="y / mm",
        title="From the mounting plane",
        aspect="equal",
        xlim=(-110, 230),
        ylim=(-110, 115),
    )


def disc(ax, blank, outer, bore):
    """Disc with its openings, of the outlines that the mesh has."""
    ax.add_patch(Circle((0, 0), outer, fc=METAL, ec=EDGE))
    ax.add_patch(Circle((0, 0), bore, fc="white", ec=EDGE))
    openings = blank.cutouts
    for i in range(openings.count):
        turn = openings.phase + 2 * np.pi * i / openings.count
        sides = [openings.outline(side, np.linspace(0, 1, 40)) for side in range(4)]
        radius, angle = np.concatenate(sides, axis=1)
        ax.fill(MM * radius * np.cos(angle + turn), MM * radius * np.sin(angle + turn), fc="white", ec=EDGE)
    ax.set(aspect="equal", xlim=(-1.2 * outer, 1.2 * outer), ylim=(-1.2 * outer, 1.2 * outer))
    ax.axis("off")


def blanks(figure):
    """Thin rim in section, holes and slots in view."""
    section, holes, slots = figure.subplots(1, 3)
    rim = ThinRim(web_thickness=6e-3, hub_radius=16e-3, rim_radius=32e-3, web_offset=2e-3)
    web, face, outer, bore = rim.web, 20.0, 40.0, 10.0
    low, high, middle = MM * web.hub_radius, MM * web.rim_radius, MM * rim.web_offset
    for start, end, width, centre in (
        (bore, low, face, 0),
        (low, high, MM * web.thickness, middle),
        (high, outer, face, 0),
    ):
        section.add_patch(Rectangle((centre - width / 2, start), width, end - start, fc=METAL, ec=EDGE))
    section.plot([-18, 18], [0, 0], color=EDGE, lw=0.8, ls="-.")
    section.plot([0, 0], [-2, 44], color=EDGE, lw=0.6, ls=":")
    dimension(section, (-14, 0), (-14, low), "hub_radius", at=(-14, 10), ha="right")
    dimension(section, (15, 0), (15, high), "rim_radius", at=(4, 0), ha="left")
    dimension(section, (-17, 0), (-17, bore), "bore_radius", at=(-4, -4), ha="right")
    dimension(section, (middle - 3, 28), (middle + 3, 28), "web_thickness", at=(12, 0), ha="left")
    dimension(section, (0, 20), (middle, 20), "web_offset", at=(-14, 0), ha="right")
    dimension(section, (-face / 2, 45), (face / 2, 45), "face_width", at=(0, 6))
    section.text(14, -3.5, "z", fontsize=8)
    section.set(title='type = "thin_rim"', aspect="equal", xlim=(-38, 38), ylim=(-5, 50))
    section.axis("off")
    drilled = Holes(count=6, pitch_radius=24e-3, hole_radius=5e-3, phase=np.radians(30))
    disc(holes, drilled, outer, bore)
    holes.set_title('type = "holes"')
    at = 24 * np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    dimension(holes, (0, 0), tuple(at), "pitch_radius", at=(22, -4))
    pointer(holes, tuple(at + 5 * np.array([np.cos(1.2), np.sin(1.2)])), "hole_radius", (10, 26))
    holes.plot([0, 46], [0, 0], color=EDGE, lw=0.8, ls="-.")
    holes.text(33, -5, "tooth 0", fontsize=8)
    arc = np.linspace(0, np.radians(30), 30)
    holes.plot(36 * np.cos(arc), 36 * np.sin(arc), color=SIZE, lw=1)
    holes.text(38, 9, "phase", color=SIZE, fontsize=8)
    cut = Slots(count=5, inner_radius=20e-3, outer_radius=32e-3, angular_width=np.radians(40), fillet=2e-3)
    disc(slots, cut, outer, bore)
    slots.set_title('type = "slots"')
    turn = 2 * np.pi / 5
    for radius, name, angle in ((20, "inner_radius", turn - 0.25), (32, "outer_radius", turn + 0.2)):
        dimension(slots, (0, 0), (radius * np.cos(angle), radius * np.sin(angle)), name, at=(-4, 0), ha="right")
    width = np.linspace(-np.radians(20), np.radians(20), 40)
    slots.plot(35.5 * np.cos(width), 35.5 * np.sin(width), color=SIZE, lw=1.2)
    slots.text(42, 0, "angular_width", color=SIZE, fontsize=8, rotation=90, va="center")
    pointer(slots, (21 * np.cos(np.radians(-18)), 21 * np.sin(np.radians(-18))), "fillet", (-6, -34))


def micro_geometry(figure):
    """Material removed along the profile and along the face."""
    profile, lead = figure.subplots(1, 2)
    usable, face = (8e-3, 20e-3), 16e-3
    rolled, axial = np.linspace(*usable, 300), np.linspace(-face / 2, face / 2, 300)
    along = {
        "tip_relief, parabolic": Flank(tip_relief=Relief(20e-6, 4e-3)),
        "tip_relief, linear": Flank(tip_relief=Relief(20e-6, 4e-3, "linear")),
        "root_relief, parabolic": Flank(root_relief=Relief(12e-6, 3e-3)),
        "profile_crowning": Flank(profile_crowning=5e-6),
    }
    for name, flank in along.items():
        profile.plot(MM * rolled, UM * flank.removed(rolled, usable, 0 * rolled, face), label=name)
    dimension(profile, (16, 22.5), (20, 22.5), "length", at=(0, 6))
    dimension(profile, (20.2, 0), (20.2, 20), "amount", at=(4, 0), ha="left")
    profile.text(8, -3, "form circle", fontsize=8, ha="center", va="top")
    profile.text(20, -3, "tip form circle", fontsize=8, ha="center", va="top")
    profile.set(
        xlabel="rolled length / mm", ylabel="material removed / µm", xlim=(7, 23), ylim=(-6, 27), title="Profile"
    )
    for name, flank in {
        "lead_crowning = 6 µm": Flank(lead_crowning=6e-6),
        "lead_slope = 10 µm": Flank(lead_slope=10e-6),
        "lead_slope = −10 µm": Flank(lead_slope=-10e-6),
    }.items():
        lead.plot(MM * axial, UM * flank.removed(np.full(300, 14e-3), usable, axial, face), label=name)
    dimension(lead, (-8, 12), (8, 12), "face_width", at=(0, 6))
    lead.set(
        xlabel="z from mid-width / mm", ylabel="material removed / µm", ylim=(-1, 15), title="Face, at mid-profile"
    )
    for ax in (profile, lead):
        ax.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncol=2)


def frames(figure):
    """Shafts, gears, bearings and microphone of the example in the frame of the case."""
    case = example()
    ax = figure.subplots()
    for shaft in case.shafts:
        x = MM * shaft.axis[0]
        for part in shaft.segments:
            low, high, radius = MM * part.start, MM * part.end, MM * part.outer_diameter / 2
            ax.add_patch(Rectangle((low, x - radius), high - low, 2 * radius, fc=METAL, ec=EDGE, lw=0.8))
        ax.plot([-60, 165], [x, x], color=EDGE, lw=0.8, ls="-.")
        ax.text(-62, x, f"shaft {shaft.name}\naxis = [{x:g}, 0] mm", ha="right", va="center", fontsize=8)
    axis = {shaft.name: MM * shaft.axis[0] for shaft in case.shafts}
    for gear in case.gears:
        radius, width = MM * gear.geometry.pitch_radius, MM * gear.geometry.face_width
        x, z = axis[gear.shaft], MM * gear.z
        ax.add_patch(Rectangle((z - width / 2, x - radius), width, 2 * radius, fc="#9fb3c4", ec=EDGE, lw=0.8))
        ax.text(z, x, f"{gear.name}\nz = {z:g}", ha="center", va="center", fontsize=8)
    for bearing in case.bearings:
        x, z = axis[bearing.shaft], MM * bearing.z
        for side in (-1, 1):
            ax.add_patch(Rectangle((z - 6, x + side * 18 - 4), 12, 8, fc="white", ec=SIZE))
        ax.text(z, x + 26, f"{bearing.name}, z = {z:g}", ha="center", fontsize=8, color=SIZE)
    a, b = axis.values()
    dimension(ax, (150, a), (150, b), "centre_distance", at=(4, 0), ha="left")
    ax.axvline(0, color=EDGE, lw=1.2)
    ax.text(-2, -52, "mounting plane z = 0", rotation=90, ha="right", va="bottom", fontsize=8)
    for direction, name in (((28, 0), "z"), ((0, 28), "x")):
        ax.annotate(
            "", (-130 + direction[0], -45 + direction[1]), (-130, -45), arrowprops={"arrowstyle": "->", "lw": 1.5}
        )
        ax.text(-130 + 1.2 * direction[0], -45 + 1.2 * direction[1], name, ha="center", va="center")
    ax.plot(-130, -45, "o", ms=9, mfc="white", mec="black")
    ax.plot(-130, -45, ".", ms=5, color="black")
    ax.text(-138, -52, "y, towards the reader", fontsize=8, va="top")
    ax.set(xlabel="z / mm", ylabel="x / mm", aspect="equal", xlim=(-145, 205), ylim=(-65, 125))


PICTURES = {
    "frames": (frames, (9, 5), "Frame of the case: z along the shafts, mounting plane at z = 0"),
    "casting": (casting, (9, 11), "Section and view of a casting with the names of its fields"),
    "blanks": (blanks, (11, 4.2), "Thin rim, holes and slots with the names of their fields"),
    "micro_geometry": (micro_geometry, (10, 4.2), "Material removed by the modifications of a flank"),
}


def drawn(name):
    """Picture as SVG text."""
    draw, size, _ = PICTURES[name]
    figure = Figure(figsize=size, layout="constrained")
    draw(figure)
    file = io.StringIO()
    figure.savefig(file, format="svg", facecolor="white")
    return file.getvalue()


class CaseDrawing(SphinxDirective):
    """One picture by name."""

    required_arguments = 1

    def run(self):
        (name,) = self.arguments
        self.env.note_dependency(__file__)
        code = base64.b64encode(drawn(name).encode()).decode()
        text = f'<img alt="{PICTURES[name][2]}" style="width: 100%" src="data:image/svg+xml;base64,{code}">'
        return [nodes.raw("", text, format="html")]


def setup(app):
    app.add_directive("case-drawing", CaseDrawing)
    return {"parallel_read_safe": True}
