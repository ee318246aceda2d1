"""Case file (TOML) of an imported unit, with comments."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import fields
from math import degrees, pi

from nvhchain.bearings.springs import StiffnessMatrix
from nvhchain.case.gearbox import USUAL_DAMPING
from nvhchain.case.options import DECIDABLE
from nvhchain.case.rexs.model import ImportedCase, Support, microphone
from nvhchain.case.rexs.rolling import RollingModel
from nvhchain.case.toml.meanings import type_name
from nvhchain.errors import counted
from nvhchain.gear import GearGeometry
from nvhchain.gear.drawing.micro_geometry import Flank
from nvhchain.housing import InnerWall
from nvhchain.interop.rexs import ImportedGear


def case_text(case: ImportedCase, name: str, source: str, *, rigid: bool) -> str:
    """Return the text of a case file."""
    unit = case.unit
    shift = case.drawn.shift
    blocks = [
        _head(case, name, source, rigid=rigid),
        *(_gear(case, gear) for gear in unit.gears),
        *(_stage(case, number) for number in range(len(unit.stages))),
        *(_shaft(case, shaft.name) for shaft in unit.shafts),
        *(_bearing("bearings", support, support.z + shift) for support in case.supports),
        *(_bearing("shaft_bearings", support, support.z + shift) for support in case.links),
        _housing(case),
    ]
    return "\n".join(blocks)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def _mm(value: float) -> str:
    """Return a length (m) in millimetres, to a nanometre."""
    return f"{round(1e3 * value, 6) + 0.0:.10g}"


def _mms(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_mm, values))}]"


def _lengths(owner: object, names: str) -> list[str]:
    """Return the lines of lengths (m) of an object, by their names."""
    return [f"{name}_mm = {_mm(getattr(owner, name))}" for name in names.split()]


def _names(**texts: str) -> list[str]:
    return [f"{key} = {_text(text)}" for key, text in texts.items()]


def _comment(text: str) -> str:
    return " ".join(text.split())


def _head(case: ImportedCase, name: str, source: str, *, rigid: bool) -> str:
    unit, (low, high, step) = case.unit, case.band
    assumed = len(unit.findings.select("assumed"))
    others = [
        f"# load case {load.name}: input_speed_rpm = {30 / pi * load.speed:.6g}, input_torque = {load.torque:.6g}"
        + (f", input_rotation = {-unit.input_rotation}" if load.reversed else "")
        for load in unit.loads[1:]
        if load.speed and load.torque
    ]
    quantities = '["bearing_forces"]' if rigid else '["pressure"]'
    chosen = f" # load case {unit.loads[0].name} of the file" if unit.loads[0].name else ""
    lines = [
        f"# {_comment(source)}: REXS {unit.version} written by {_comment(unit.application)}.",
        f"# {counted(assumed, 'value')} assumed: import.md beside this file has the list with their sources.",
        "# Frame: z along the shafts, x and y the v and w axes of the file; z = u + "
        f"{_mm(case.drawn.shift)} mm, so that the casting stands on z = 0.",
        'kind = "gearbox"',
        *_names(name=name, input_shaft=unit.input_shaft, output_shaft=unit.output_shaft),
        f"input_rotation = {unit.input_rotation}",
        f"quantities = {quantities}",
        "assumptions = [",
        *(f"    {_text(sentence)}," for sentence in assumptions(case, rigid=rigid)),
        "]",
        "",
        "[operation]" + chosen,
        f"input_speed_rpm = {30 / pi * case.speed:.9g}",
        f"input_torque = {case.torque:.9g} # N m",
        *others,
        "",
        "[band] # Hz; ten harmonics of the fastest mesh, 2 to 4 kHz",
        f"low = {low:g}",
        f"high = {high:g}",
        f"resolution = {step:g}",
        "",
        "[options] # modelled where `plan` finds that it matters",
        *(f'{name} = "auto"' for name in DECIDABLE),
    ]
    if rigid:
        lines.append("rigid_housing = true # bearing forces on fixed seats; without it the housing below takes part")
    lines += [
        "",
        "[[field_points]] # 1 m beside the casting",
        'name = "side 1 m"',
        f"position = [{', '.join(f'{x:.4g}' for x in microphone(case))}]",
        "",
    ]
    return "\n".join(lines)


def assumptions(case: ImportedCase, *, rigid: bool) -> list[str]:
    """Return the sentences that stand beside every level."""
    drawn = "The housing is drawn by rule around the gears: the imported file has none."
    found = ["Bearing seats are rigid: the imported file has no housing." if rigid else drawn]
    record = case.unit.findings.select("assumed")
    estimated = sum(line.quantity == "radial stiffness" for line in record)
    count = len(case.supports) + len(case.links)
    if estimated:
        found.append(f"Stiffness of {min(estimated, count)} of {count} bearings is estimated by type and size.")
    given = [line.quantity for line in record if line.part == "operation" and line.quantity.startswith("input ")]
    given = [quantity for quantity in given if quantity != "input shaft"]
    if given:
        found.append(f"The {' and the '.join(given)} is assumed: the imported file has none.")
    return found


def _gear(case: ImportedCase, gear: ImportedGear) -> str:
    drawn = case.gears[gear.name]
    z = case.arrangement.planes[gear.name] + case.drawn.shift
    lines = [
        "[[gears]]",
        *_names(name=gear.name, shaft=gear.shaft),
        f"z_mm = {_mm(z)}",
        *_material(gear.young, gear.poisson, gear.density),
        "[gears.geometry]",
        f"teeth = {drawn.teeth}",
        *_lengths(drawn, "normal_module"),
        f"normal_pressure_angle_deg = {degrees(drawn.normal_pressure_angle):.10g}",
        f"helix_angle_deg = {degrees(drawn.helix_angle) + 0.0:.10g}",
        *_lengths(drawn, "face_width bore_radius"),
        *(f"{name} = {getattr(drawn, name):.9g}" for name in ("profile_shift", "addendum", "dedendum")),
    ]
    if drawn.rack_tip_radius is not None:
        lines.append(f"rack_tip_radius = {drawn.rack_tip_radius:.9g}")
    if drawn.tip_radius is not None:
        lines += _lengths(drawn, "tip_radius")
    lines.append(f"thickness_allowance_um = {1e6 * drawn.thickness_allowance:.9g}")
    if drawn.tip_chamfer:
        lines += _lengths(drawn, "tip_chamfer")
    if drawn.protuberance is not None:
        sizes = ", ".join(_lengths(drawn.protuberance, "amount grinding_allowance"))
        lines.append(f"protuberance = {{ {sizes}, angle_deg = {degrees(drawn.protuberance.angle):.9g} }}")
    lines += _micro(drawn)
    return "\n".join(lines) + "\n"


def _material(young: float, poisson: float, density: float) -> list[str]:
    if (young, poisson, density) == (210e9, 0.3, 7850.0):
        return []
    return [
        f"material = {{ young_GPa = {1e-9 * min(young, 2e12):.6g}, poisson = {poisson:.6g}, density = {density:.6g} }}"
    ]


def _micro(drawn: GearGeometry) -> list[str]:
    lines = []
    for side in ("drive", "coast"):
        flank: Flank = getattr(drawn.micro, side)
        if flank == Flank():
            continue
        lines.append(f"[gears.geometry.micro.{side}]")
        for field in ("profile_crowning", "lead_crowning"):
            if getattr(flank, field):
                lines.append(f"{field}_um = {1e6 * getattr(flank, field):.6g}")
        for field in ("tip_relief", "root_relief"):
            relief = getattr(flank, field)
            if relief is not None:
                lines.append(
                    f"{field} = {{ amount_um = {1e6 * relief.amount:.6g}, length_mm = {1e3 * relief.length:.6g}, "
                    f'shape = "{relief.shape}" }}'
                )
    return lines


def _stage(case: ImportedCase, number: int) -> str:
    stage = case.unit.stages[number]
    names = _names(name=stage.name, pinion=stage.pinion, wheel=stage.wheel)
    distance = f"centre_distance_mm = {_mm(case.arrangement.distances[stage.name])}"
    return "\n".join(["[[stages]]", *names, distance, ""])


def _shaft(case: ImportedCase, name: str) -> str:
    shift = case.drawn.shift
    lines = ["[[shafts]]", f"name = {_text(name)}", f"axis_mm = {_mms(case.arrangement.axes[name])}", "segments = ["]
    for piece in case.pieces[name]:
        fields = [
            f"start_mm = {_mm(piece.start + shift)}",
            f"end_mm = {_mm(piece.end + shift)}",
            f"outer_diameter_mm = {_mm(piece.outer)}",
        ]
        if piece.inner > 0:
            fields.append(f"inner_diameter_mm = {_mm(piece.inner)}")
        if (piece.young, piece.poisson, piece.density) != (210e9, 0.3, 7850.0):
            fields.append(f"young_GPa = {1e-9 * piece.young:.6g}")
            fields += [f"{name} = {getattr(piece, name):.6g}" for name in ("poisson", "density")]
        lines.append(f"    {{ {', '.join(fields)} }},")
    lines.append("]")
    masses = next(shaft.masses for shaft in case.unit.shafts if shaft.name == name)
    if masses:
        lines.append("bodies = [ # additional masses of the file")
        for body in masses:
            inertia = ", ".join(f"{key} = {getattr(body, key):.9g}" for key in _INERTIA)
            lines.append(f"    {{ z_mm = {_mm(body.z + case.arrangement.shifts[name] + shift)}, {inertia} }},")
        lines.append("]")
    loads = [load for load in case.unit.side_loads if load.shaft == name]
    if loads:
        lines.append("loads = [ # N and N m, from outside")
        for load in loads:
            force, moment = (
                ", ".join(f"{value + 0.0:.9g}" for value in values) for values in (load.force, load.moment)
            )
            lines.append(f"    {{ z_mm = {_mm(load.z + shift)}, force = [{force}], moment = [{moment}] }},")
        lines.append("]")
    return "\n".join([*lines, ""])


_INERTIA = ("mass", "polar_inertia", "transverse_inertia")


def _bearing(table: str, support: Support, z: float) -> str:
    bearing, own = support.bearing, support.estimate
    words = [bearing.kind, f"{_mm(own.bore)} x {_mm(own.outer_diameter)} x {_mm(own.width)} mm"]
    words += [f"{key} {value}" for key, value in bearing.catalogue.items() if key not in ("bearing_type",)]
    names = {"name": bearing.name, "shaft": bearing.shaft}
    names |= {"outer_shaft": bearing.outer_shaft} if bearing.outer_shaft else {}
    lines = [f"[[{table}]] # {_comment('; '.join(words))}", *_names(**names)]
    lines.append(f"z_mm = {_mm(z)}")
    if own.model is None:
        lines += [
            f"radial_stiffness = {own.radial_stiffness:.4g} # N/m; {_comment(own.source)}",
            f"axial_stiffness = {own.axial_stiffness:.4g}",
        ]
    if isinstance(own.model, StiffnessMatrix):
        lines += [
            'model.type = "stiffness_matrix"',
            "model.matrix = [ # x, y, z, θx, θy: N/m, N, N m; at the operating point of the file",
            *(f"    [{', '.join(f'{value + 0.0:.6g}' for value in row)}]," for row in own.model.matrix),
            "]",
        ]
    lines.append(f"# stiffness_damping = {USUAL_DAMPING:g} # s, the default; E. Krämer 1993: (0.25…2.5)e-5 s")
    if own.model is not None and not isinstance(own.model, StiffnessMatrix):
        lines += [f"[{table}.model]", *_model(own.model)]
    return "\n".join([*lines, ""])


_LENGTHS = (
    *("bore", "outer_diameter", "width", "element_diameter", "element_length", "row_distance"),
    *("pitch_diameter", "inner_groove_radius", "outer_groove_radius"),
)


def _model(model: RollingModel) -> list[str]:
    """Return the lines of a rolling bearing: its type, and all fields that are not the default."""
    lines = [f'type = "{type_name(type(model))}"']
    for field in fields(model):
        value = getattr(model, field.name)
        if value is None or value == field.default:
            continue
        if field.name == "contact_angle":
            lines.append(f"contact_angle_deg = {degrees(value):.10g}")
        elif field.name == "clearance":
            lines.append(f"clearance_um = {1e6 * value:.6g} # in operation")
        elif field.name in _LENGTHS:
            lines += _lengths(model, field.name)
        elif isinstance(value, bool | str):
            lines.append(f"{field.name} = {json.dumps(value)}")
        else:
            lines.append(f"{field.name} = {value:.10g}")
    return lines


def _housing(case: ImportedCase) -> str:
    casting = case.drawn.casting
    lengths = (
        "wall end_wall depth bell_depth draft chamfer boss_thickness cover_thickness flange_width flange_thickness"
    )
    lines = [
        "[housing] # drawn by rule: import.md lists the rules",
        *_lengths(casting, lengths),
        f"bolts = {casting.bolts}",
        *_lengths(casting, "bolt_radius lug_radius rib_height"),
        *(f"{name} = {getattr(casting, name)}" for name in ("spokes", "side_ribs", "modal_damping")),
        "gear_spaces = [",
        *(f"    {{ centre_mm = {_mms(s.centre)}, radius_mm = {_mm(s.radius)} }}," for s in casting.gear_spaces),
        "]",
        "bores = [",
    ]
    for bore in casting.bores:
        sizes = f"radius_mm = {_mm(bore.radius)}, length_mm = {_mm(bore.length)}"
        lines.append(f"    {{ name = {_text(bore.name)}, centre_mm = {_mms(bore.centre)}, {sizes} }},")
    lines.append("]")
    for wall in casting.inner_walls:
        lines += _inner_wall(wall)
    material = casting.material
    lines += [
        "[housing.material]",
        f"young_GPa = {1e-9 * material.young:.6g}",
        f"poisson = {material.poisson:.6g}",
        f"density = {material.density:.6g} # kg/m³",
        "",
    ]
    return "\n".join(lines)


def _inner_wall(wall: InnerWall) -> Sequence[str]:
    holes = ", ".join(
        f"{{ centre_mm = {_mms(hole.centre)}, radius_mm = {_mm(hole.radius)} }}" for hole in wall.openings
    )
    return (
        "[[housing.inner_walls]] # carries the bearings between the gears",
        *_lengths(wall, "z thickness"),
        f"openings = [{holes}]",
    )
