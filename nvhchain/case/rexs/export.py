"""Export of a gearbox case to REXS, for what the format holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from math import degrees, pi, tan
from pathlib import Path

import numpy as np

from nvhchain import __version__
from nvhchain.bearings import AngularContact, Cylindrical, Tapered
from nvhchain.bearings.catalogue import RollingBearing
from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.gears import Gear, Stage
from nvhchain.conventions import STEEL, Material
from nvhchain.dynamics import Bearing, Shaft, ShaftBearing
from nvhchain.gear import GearPair, Misalignment, Solid
from nvhchain.gear.drawing.micro_geometry import Flank
from nvhchain.handoff import FloatArray
from nvhchain.interop.rexs.contents.write import Draft, Value, write_draft

_NO_UNIT = "none"


def export_rexs(case: GearboxCase, path: str | Path) -> tuple[str, ...]:
    """Write shafts, gears, stages, bearings and load of a case as REXS 1.4.

    Returns parts of the case that the file does not hold.
    """
    draft = Draft()
    unit = draft.add("gear_unit", case.name, {**_place(0.0, (0.0, 0.0), 1)})
    casing = draft.add("gear_casing", "Casing", {})
    draft.relate("assembly", assembly=unit, part=casing)
    shafts = {shaft.name: _shaft(draft, unit, shaft) for shaft in case.shafts}
    starts = {shaft.name: _start(shaft) for shaft in case.shafts}
    gears = {gear.name: _gear(draft, case, gear, shafts[gear.shaft], starts[gear.shaft]) for gear in case.gears}
    for stage, pair in zip(case.stages, case.pairs, strict=True):
        _stage(draft, case, unit, stage, pair, gears)
    for bearing, loaded in zip(case.gearbox_with_gears.bearings, case.gearbox_on_rigid_seats.bearings, strict=True):
        _bearing(draft, bearing if isinstance(bearing.model, RollingBearing) else loaded, shafts, starts, casing)
    for link in case.shaft_bearings:
        _bearing(draft, link, shafts, starts, casing)
    _load(draft, case, shafts)
    now = datetime.now(UTC).isoformat(timespec="seconds")
    write_draft(draft, Path(path), application="nvhchain", application_version=__version__, date=now)
    return tuple(_not_held(case))


def _not_held(case: GearboxCase) -> list[str]:
    """Return the parts of a case that REXS does not hold."""
    found = ["housing", "microphones, band and options"]
    found += [f"blank of gear {gear.name}" for gear in case.gears if not isinstance(gear.blank, Solid)]
    found += [f"looseness of gear {gear.name}" for gear in case.gears if gear.loose]
    slopes = [g.name for g in case.gears if g.geometry.micro.drive.lead_slope or g.geometry.micro.coast.lead_slope]
    found += [f"lead slope of gear {name}" for name in slopes]
    for gear in case.gears:
        if gear.deviations is not None:
            found.append(f"deviations of gear {gear.name}")
    for stage in case.stages:
        if stage.tolerances is not None or stage.misalignment != Misalignment():
            found.append(f"misalignment and tolerances of stage {stage.name}")
    for shaft in case.shafts:
        if len({(segment.young, segment.poisson, segment.density) for segment in shaft.segments}) > 1:
            found.append(f"materials of shaft {shaft.name} but that of its first segment")
    for bearing in (*case.bearings, *case.shaft_bearings):
        found += [f"{what} of bearing {bearing.name}" for what in _not_held_of(bearing.model)]
    found += ["damping of bearings and shafts"]
    found += [f"coupled inertia of shaft {shaft.name}" for shaft in case.shafts if shaft.coupled_inertia]
    if case.operation.ramp is not None or case.operation.fluctuation is not None:
        found.append("ramp and fluctuation of the operation")
    return found


def _not_held_of(model: object) -> Iterator[str]:
    """Yield the values of a bearing's model that REXS does not hold."""
    if isinstance(model, RollingBearing) and any(model.misalignment):
        yield "misalignment"
    if isinstance(model, Cylindrical) and model.axial_stiffness:
        yield "axial stiffness of the ribs"


def _mm(value: float) -> Value:
    return 1e3 * value, "mm"


def _place(z: float, axis: tuple[float, float], reference: int) -> dict[str, Value]:
    return {
        "support_vector": ([1e3 * z, 1e3 * axis[0], 1e3 * axis[1]], "mm"),
        "u_axis_vector": ([1.0, 0.0, 0.0], "mm"),
        "w_axis_vector": ([0.0, 0.0, 1.0], "mm"),
        "reference_component_for_position": (reference, _NO_UNIT),
    }


def _start(shaft: Shaft) -> float:
    return min((segment.start for segment in shaft.segments), default=0.0)


def _material(draft: Draft, owner: int, young: float, poisson: float, density: float) -> None:
    material = draft.add(
        "material",
        "Material",
        {
            "elastic_modulus": (1e-6 * young, "N / mm^2"),
            "poisson_ratio": (poisson, _NO_UNIT),
            "density": (1e-3 * density, "kg / dm^3"),
        },
    )
    draft.relate("reference", origin=owner, referenced=material)


def _shaft(draft: Draft, unit: int, shaft: Shaft) -> int:
    start = _start(shaft)
    number = draft.add("shaft", shaft.name, _place(start, shaft.axis, unit))
    draft.relate("assembly", assembly=unit, part=number)
    for segment in shaft.segments:
        section = draft.add(
            "shaft_section",
            "",
            {
                "u_coordinate_on_shaft": _mm(segment.start - start),
                "length": _mm(segment.end - segment.start),
                "outer_diameter_begin": _mm(segment.outer_diameter),
                "outer_diameter_end": _mm(segment.outer_diameter),
                "inner_diameter_begin": _mm(segment.inner_diameter),
                "inner_diameter_end": _mm(segment.inner_diameter),
            },
        )
        draft.relate("assembly", assembly=number, part=section)
    for body in shaft.bodies:
        mass = draft.add(
            "additional_mass",
            "",
            {
                "u_coordinate_on_shaft": _mm(body.z - start),
                "mass_of_component": (body.mass, "kg"),
                "moment_of_inertia_u_axis": (body.polar_inertia, "kg m^2"),
                **{f"moment_of_inertia_{axis}_axis": (body.transverse_inertia, "kg m^2") for axis in "vw"},
            },
        )
        draft.relate("assembly", assembly=number, part=mass)
    if shaft.segments:
        first = shaft.segments[0]
        _material(draft, number, first.young, first.poisson, first.density)
    return number


def _gear(draft: Draft, case: GearboxCase, gear: Gear, shaft: int, start: float) -> int:
    drawn = gear.geometry
    nominal = drawn.normal_module * (pi / 2 + 2 * drawn.profile_shift * tan(drawn.normal_pressure_angle))
    number = draft.add(
        "cylindrical_gear",
        gear.name,
        {
            "u_coordinate_on_shaft": _mm(gear.z - start),
            "number_of_teeth": (drawn.teeth, _NO_UNIT),
            "normal_module": _mm(drawn.normal_module),
            "helix_angle_reference_diameter": (degrees(drawn.helix_angle), "deg"),
            "face_width": _mm(drawn.face_width),
            "inner_diameter": _mm(2 * drawn.bore_radius),
            "tip_diameter": _mm(2 * drawn.tip_circle_radius),
            "root_diameter": _mm(2 * drawn.root_radius),
            "reference_circle_diameter": _mm(2 * drawn.pitch_radius),
            "base_circle_diameter": _mm(2 * drawn.base_radius),
            "normal_tooth_thickness_at_pitch_diameter": _mm(nominal - drawn.thickness_allowance),
        },
    )
    draft.relate("assembly", assembly=shaft, part=number)
    material: Material = gear.material or STEEL
    _material(draft, number, material.young, material.poisson, material.density)
    flanks = {side: _flank(draft, gear, flank) for side, flank in _sides(gear)}
    bulge = drawn.protuberance
    draft.relate("flank", gear=number, **flanks)
    tool = draft.add(
        "rack_shaped_tool",
        "",
        {
            "addendum_coefficient_reference_profile": (drawn.dedendum, _NO_UNIT),
            "tip_radius_factor": (drawn.rack_tip_radius_in_use, _NO_UNIT),
            **(
                {"protuberance_amount": _mm(bulge.amount), "protuberance_angle": (degrees(bulge.angle), "deg")}
                if bulge
                else {}
            ),
        },
    )
    stock: dict[str, Value] = {"machining_allowance": _mm(bulge.grinding_allowance)} if bulge else {}
    settings = draft.add("cylindrical_gear_manufacturing_settings", "", stock)
    for flank in flanks.values():
        draft.relate("manufacturing_step", workpiece=flank, tool=tool, manufacturing_settings=settings)
    return number


def _sides(gear: Gear) -> tuple[tuple[str, Flank], tuple[str, Flank]]:
    return ("left", gear.geometry.micro.drive), ("right", gear.geometry.micro.coast)


def _flank(draft: Draft, gear: Gear, flank: Flank) -> int:
    drawn = gear.geometry
    number = draft.add(
        "cylindrical_gear_flank",
        "",
        {
            "normal_pressure_angle": (degrees(drawn.normal_pressure_angle), "deg"),
            "addendum_modification_coefficient": (drawn.profile_shift, _NO_UNIT),
            **({"tooth_tip_chamfer": _mm(drawn.tip_chamfer)} if drawn.tip_chamfer else {}),
        },
    )
    parts: list[tuple[str, Mapping[str, Value]]] = []
    for end, relief in (("tip", flank.tip_relief), ("root", flank.root_relief)):
        if relief is not None:
            sizes: dict[str, Value] = {
                f"{end}_relief_depth": _mm(relief.amount),
                f"{end}_relief_datum_length": _mm(relief.length),
                "shape_of_relief": (relief.shape, _NO_UNIT),
            }
            parts.append((f"{end}_relief", sizes))
    for kind, amount, ends in (
        ("profile_crowning", flank.profile_crowning, ("profile_crowning_at_tip", "profile_crowning_at_root")),
        (
            "helix_crowning",
            flank.lead_crowning,
            ("helix_crowning_amount_datum_face", "helix_crowning_amount_non_datum_face"),
        ),
    ):
        if amount:
            parts.append((kind, {end: _mm(amount) for end in ends}))
    for kind, attributes in parts:
        draft.relate("reference", origin=number, referenced=draft.add(kind, "", attributes))
    return number


def _stage(draft: Draft, case: GearboxCase, unit: int, stage: Stage, pair: GearPair, gears: Mapping[str, int]) -> None:
    """Add a stage; the pinion drives with its left flanks, an idler with its right ones, under a torque above zero."""
    forward = case.operation.input_torque >= 0
    idles = any(stage.pinion == other.wheel for other in case.stages)
    number = draft.add(
        "cylindrical_stage",
        stage.name,
        {
            "center_distance": _mm(stage.centre_distance),
            "radial_contact_ratio": (pair.transverse_contact_ratio, _NO_UNIT),
            "overlap_contact_ratio": (pair.overlap_ratio, _NO_UNIT),
            "total_contact_ratio": (pair.total_contact_ratio, _NO_UNIT),
            "common_face_width": _mm(pair.face_width),
        },
    )
    draft.relate("assembly", assembly=unit, part=number)
    draft.relate("stage", stage=number, gear_1=gears[stage.pinion], gear_2=gears[stage.wheel])
    for gear, driving, left in ((stage.pinion, forward, forward is not idles), (stage.wheel, not forward, forward)):
        data = draft.add(
            "cylindrical_stage_gear_data",
            "",
            {
                "operating_pressure_angle_in_the_transverse_section": (degrees(pair.working_pressure_angle), "deg"),
                "is_driving_gear": (driving, _NO_UNIT),
                "loaded_tooth_flank": ("left" if left else "right", _NO_UNIT),
            },
        )
        draft.relate("stage_gear_data", stage=number, gear=gears[gear], stage_gear_data=data)


def _bearing(
    draft: Draft, bearing: Bearing, shafts: Mapping[str, int], starts: Mapping[str, float], casing: int
) -> None:
    place = bearing.z - starts[bearing.shaft]
    if isinstance(bearing.model, RollingBearing):
        numbers = [
            _rolling(draft, f"{bearing.name} {one + 1}" if one else bearing.name, model, _where(place + z))
            for one, (z, model) in enumerate(_singles(bearing.model))
        ]
    else:
        whole = bearing.evaluate(np.zeros(5))[1]  # constant, or at the load
        stiffness = np.diag(whole)
        number = draft.add(
            "concept_bearing",
            bearing.name,
            _where(place)
            | {
                "axial_force_absorption": ("both_directions", _NO_UNIT),
                "radial_stiffness": (float(stiffness[:2].mean()), "N / m"),
                "axial_stiffness": (float(stiffness[2]), "N / m"),
                **_operating(whole),
            },
        )
        numbers = [number]
    outer = shafts[bearing.outer_shaft] if isinstance(bearing, ShaftBearing) else casing
    for number in numbers:
        draft.relate("side", assembly=number, inner_part=shafts[bearing.shaft], outer_part=outer)


def _operating(stiffness: FloatArray) -> dict[str, Value]:
    """Return a stiffness (5, 5) at the operating point in the words of REXS, where it is more than two springs."""
    coupled = (stiffness - np.diag(np.diag(stiffness))).any() or np.diag(stiffness)[3:].any()
    if not coupled and stiffness[0, 0] == stiffness[1, 1]:
        return {}
    found: dict[str, Value] = {}
    for i, force in _REXS_AXES.items():
        for j, motion in _REXS_AXES.items():
            value, tilts = float(stiffness[i, j]), (i > 2) + (j > 2)
            unit = "N mm / rad" if tilts > 1 else "N / m" if not tilts else "N / rad" if j > 2 else "N"
            name = f"operating_point_stiffness_{'m' if i > 2 else 'f'}_{force}_{'rot' if j > 2 else 'd'}_{motion}"
            found[name] = (1e3 * value if tilts > 1 else value, unit)
    return found


_REXS_AXES = {0: "v", 1: "w", 2: "u", 3: "v", 4: "w"}
"""Axes of REXS of the motions x, y, z, θx, θy of a bearing."""


def _where(place: float) -> dict[str, Value]:
    return {"u_coordinate_on_shaft_inner_side": _mm(place), "radial_force_absorption": (True, _NO_UNIT)}


def _singles(model: RollingBearing) -> list[tuple[float, RollingBearing]]:
    """Return the bearings of a pair, each with its place (m) from the centre of the pair.

    A double-row bearing, an O pair of rows within the width of one bearing, stays one, as a single bearing does.
    """
    double = model.arrangement == "back_to_back" and model.places[1] - model.places[0] < (model.width or 0.0)
    if model.arrangement == "single" or (double and isinstance(model, AngularContact)):
        return [(0.0, model)]
    if not isinstance(model, AngularContact | Tapered):
        return [(z, replace(model, arrangement="single")) for z in model.places]
    ways = {"back_to_back": (1, -1), "face_to_face": (-1, 1)}.get(model.arrangement, (model.thrust, model.thrust))
    half = 0.5 * model.axial_clearance
    return [
        (z, replace(model, arrangement="single", thrust=way, axial_clearance=half))
        for z, way in zip(model.places, ways, strict=True)
    ]


_TYPES = {
    "DeepGroove": "radial_grooved_ball_bearing",
    "AngularContact": "angular_contact_ball_bearing",
    "Cylindrical": "radial_roller_bearing",
    "Tapered": "radial_tapered_roller_bearing",
    "Spherical": "radial_self_aligning_roller_bearing",
}


def _rolling(draft: Draft, name: str, model: RollingBearing, where: Mapping[str, Value]) -> int:
    """Add a single or double-row rolling bearing with its boundary dimensions, ratings and elements."""
    inside = model.internal
    axial = {1: "positive", -1: "negative"}.get(getattr(model, "thrust", 0), "both_directions")
    if model.floating or (isinstance(model, Cylindrical) and model.axial_stiffness == 0.0):
        axial = "no_direction"
    row_count = len(model.places)  # 2 for double-row ball bearings: ISO 76 and ISO 281 rate i rows by i and i^0.7
    static = row_count * (model.static_load_rating or inside.static_rating)
    dynamic = row_count**0.7 * (model.dynamic_load_rating or inside.dynamic_rating)
    given = {
        "inner_diameter": model.bore,
        "outer_diameter": model.outer_diameter,
        "width": model.width,
        "distance_between_bearing_rows": model.row_distance if row_count > 1 else None,
        "operating_radial_bearing_clearance": getattr(model, "clearance", None),
        "operating_axial_bearing_clearance": getattr(model, "axial_clearance", None),
    }
    number = draft.add(
        "rolling_bearing_with_detailed_geometry",
        name,
        dict(where)
        | {
            "bearing_type": (_TYPES[type(model).__name__], _NO_UNIT),
            "axial_force_absorption": (axial, _NO_UNIT),
            "number_of_bearing_rows": (max(inside.rows, len(model.places)), _NO_UNIT),
            "radial_static_load_rating": (static, "N"),
            "radial_dynamic_load_rating": (dynamic, "N"),
        }
        | {key: _mm(value) for key, value in given.items() if value},
    )
    row = {
        "number_of_rolling_elements": (inside.count, _NO_UNIT),
        "pressure_angle": (degrees(inside.angle), "deg"),
        "reference_diameter": _mm(inside.pitch_diameter),
    }
    for ring in ("inner", "outer"):
        radius = getattr(model, f"{ring}_groove_radius", None)
        row |= {f"raceway_radius_of_{ring}_ring": _mm(radius)} if radius else {}
        row |= {f"significant_contact_length_{ring}_ring": _mm(inside.length)} if inside.length else {}
    element = {"diameter_of_rolling_element": _mm(inside.diameter)}
    if inside.length:
        element["length_of_rolling_element"] = _mm(inside.length)
    rows = draft.add("rolling_bearing_row", f"{name} row", row)
    balls = draft.add("rolling_element", f"{name} element", element)
    draft.relate("ordered_assembly", assembly=number, part=rows)
    draft.relate("ordered_assembly", assembly=rows, part=balls)
    return number


def _load(draft: Draft, case: GearboxCase, shafts: Mapping[str, int]) -> None:
    """Add the torques at input and output, the loads beside them, and the speed of the input."""
    speed, torque = case.operation.input_speed, case.operation.input_torque
    turns = case.shaft_orders.get(case.output_shaft, 1)
    senses = case.rotations
    for name, power in ((case.input_shaft, torque), (case.output_shaft, -torque / float(turns or 1))):
        load = draft.add("external_load", f"Load on {name}", {"transmits_torque": (True, _NO_UNIT)})
        draft.relate("assembly", assembly=shafts[name], part=load)
        draft.load_case[load] = {"torque_around_u_axis": (senses.get(name, 1) * power, "N m")}
    for shaft in case.shafts:
        for side in shaft.loads:
            place = {"u_coordinate_on_shaft": _mm(side.z - _start(shaft)), "transmits_torque": (False, _NO_UNIT)}
            load = draft.add("external_load", f"Side load on {shaft.name}", place)
            draft.relate("assembly", assembly=shafts[shaft.name], part=load)
            (fx, fy, fz), (mx, my) = side.force, side.moment
            draft.load_case[load] = {
                **{f"force_{axis}_direction": (value, "N") for axis, value in zip("uvw", (fz, fx, fy), strict=True)},
                **{f"torque_around_{axis}_axis": (value, "N m") for axis, value in zip("vw", (mx, my), strict=True)},
            }
    draft.load_case[shafts[case.input_shaft]] = {
        "rotational_speed": (senses[case.input_shaft] * 30 / pi * speed, "1 / min")
    }
