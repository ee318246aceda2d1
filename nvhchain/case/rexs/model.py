"""Case of an imported unit: everything that its file will hold."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import ceil, cos, dist, pi

from nvhchain.bearings.loaded import holds_tilt
from nvhchain.bearings.springs import StiffnessMatrix
from nvhchain.case.rexs.arranged import Arrangement, arranged
from nvhchain.case.rexs.completed import Comparison, complete_gears, nominal_distances, shared_data
from nvhchain.case.rexs.estimates import BearingEstimate, bearing_loads, estimate
from nvhchain.case.rexs.pieces import Piece, bore_radius, pieces
from nvhchain.case.rexs.rolling import paired
from nvhchain.conventions import Material
from nvhchain.dynamics.model.gearbox import COAXIAL
from nvhchain.errors import InputError, Mistakes
from nvhchain.gear import GearGeometry
from nvhchain.housing import DrawnCasting, DrawnDisc, DrawnSeat, draw_casting
from nvhchain.interop.rexs import GearUnit, ImportedBearing, ImportedGear

USUAL_SPEED = 1500 * pi / 30
"""Speed (rad/s) of the input where the file has none."""

USUAL_LINE_LOAD = 1e5
"""Tangential force over the face width (N/m) where the file has no torque."""

_SEAT_GAP = 5e-3
"""Largest gap (m) between bearings on one shaft that share a seat."""


@dataclass(frozen=True)
class Support:
    """Bearing of the case, for one or more of the file.

    z : plane (m), in the frame of the unit.
    """

    bearing: ImportedBearing
    z: float
    estimate: BearingEstimate


@dataclass(frozen=True)
class ImportedCase:
    """Contents of the case file, in the frame of the unit.

    speed, torque : input (rad/s, N m).
    band : lowest and highest line and their spacing (Hz).
    """

    unit: GearUnit
    arrangement: Arrangement
    gears: dict[str, GearGeometry]
    pieces: dict[str, list[Piece]]
    supports: tuple[Support, ...]
    links: tuple[Support, ...]
    drawn: DrawnCasting
    comparisons: tuple[Comparison, ...]
    speed: float
    torque: float
    band: tuple[float, float, float]


def imported_case(unit: GearUnit, path: str, *, constant: Collection[str] = ()) -> ImportedCase:
    """Return the contents of the case of a unit.

    constant: bearings with constant stiffness in place of rolling elements.

    Assumptions go into the record of the unit. Raises Mistakes with all contradictions at once.
    """
    record = unit.findings

    def stop_if_wrong() -> None:
        if record.mistakes:
            raise Mistakes([f"{path}: {text}" for text in record.mistakes])

    unit = shared_data(unit)
    stop_if_wrong()
    places = arranged(unit, nominal_distances(unit))
    shafts = {shaft.name: shaft for shaft in unit.shafts}
    bores = {}
    for gear in unit.gears:
        shift = places.shifts[gear.shaft]
        bores[gear.name] = bore_radius(
            shafts[gear.shaft],
            shift,
            places.planes[gear.name],
            gear.bore_radius,
            _largest_bore(gear),
            record,
            gear.name,
        )
    stop_if_wrong()
    gears, comparisons = complete_gears(unit, places, bores)
    stop_if_wrong()
    cylinders = {
        name: pieces(shaft, places.shifts[name], _faces(unit, places, bores, name), _planes(unit, places, name), record)
        for name, shaft in shafts.items()
    }
    for name, found in cylinders.items():
        if not found:
            record.refuse(f"shaft {name}: has no shaft_section: add its sections")
    stop_if_wrong()
    speed, torque = _operation(unit, places, gears)
    supports, links = _supports(unit, places, bearing_loads(unit, places, gears, torque), constant)
    stop_if_wrong()
    try:
        drawn = _housing(unit, places, gears, cylinders, supports)
    except InputError as error:
        record.refuse(f"housing: {error}")
    stop_if_wrong()
    for quantity in ("inertia of the driving machine", "inertia of the driven machine"):
        record.add("missing", "operation", quantity, "none", "not part of REXS; coupled_inertia of a shaft takes it")
    band = _band(unit, gears, speed)
    return ImportedCase(unit, places, gears, cylinders, supports, links, drawn, tuple(comparisons), speed, torque, band)


def _largest_bore(gear: ImportedGear) -> float:
    """Return the largest bore radius (m) that leaves a rim of one module below the root."""
    pitch = 0.5 * gear.teeth * gear.module / cos(gear.helix_angle)
    depth = gear.dedendum if gear.dedendum is not None else 1.25
    root = gear.root_radius or pitch - gear.module * (depth - (gear.profile_shift or 0.0))
    return max(root - 1.05 * gear.module, 0.2 * gear.module)


def _faces(
    unit: GearUnit, places: Arrangement, bores: dict[str, float], shaft: str
) -> list[tuple[float, float, float]]:
    """Return ends (m) and bore diameter (m) of the gears on a shaft."""
    found = []
    for gear in unit.gears:
        if gear.shaft == shaft:
            middle, half = places.planes[gear.name], 0.5 * places.widths[gear.name]
            found.append((middle - half, middle + half, 2 * bores[gear.name]))
    return found


def _planes(unit: GearUnit, places: Arrangement, shaft: str) -> list[float]:
    """Return the planes (m) of all that stands on a shaft or pulls at it, bearings around it included."""
    gears = [places.planes[gear.name] for gear in unit.gears if gear.shaft == shaft]
    bearings = [b.z + places.shifts[b.shaft] for b in unit.bearings if shaft in (b.shaft, b.outer_shaft)]
    masses = [mass.z for item in unit.shafts if item.name == shaft for mass in item.masses]
    pulls = [load.z for load in unit.side_loads if load.shaft == shaft]
    return gears + bearings + [z + places.shifts[shaft] for z in (*masses, *pulls)]


def _operation(unit: GearUnit, places: Arrangement, gears: dict[str, GearGeometry]) -> tuple[float, float]:
    """Return speed (rad/s) and torque (N m) of the input; what the file has not is assumed."""
    load = unit.loads[0]
    speed, torque = load.speed, load.torque
    if speed is None:
        speed = USUAL_SPEED
        unit.findings.add("assumed", "operation", "input speed", "1500 rpm", "none in the file")
    if torque is None:
        first = next(stage for stage in unit.stages if _sits_on(unit, stage.pinion, unit.input_shaft))
        pinion = gears[first.pinion]
        width = min(places.widths[first.pinion], places.widths[first.wheel])
        torque = float(f"{USUAL_LINE_LOAD * width * pinion.pitch_radius:.2g}")
        text = "100 N/mm on the face of the first stage; none in the file"
        unit.findings.add("assumed", "operation", "input torque", f"{torque:g} N m", text)
    return speed, torque


def _sits_on(unit: GearUnit, gear: str, shaft: str) -> bool:
    return any(item.name == gear and item.shaft == shaft for item in unit.gears)


def _supports(
    unit: GearUnit, places: Arrangement, loads: dict[str, float], constant: Collection[str]
) -> tuple[tuple[Support, ...], tuple[Support, ...]]:
    """Return bearings in the housing, those beside each other as one, and bearings between shafts."""
    shafts = {shaft.name: shaft for shaft in unit.shafts}
    made = []
    for bearing in unit.bearings:
        z = bearing.z + places.shifts[bearing.shaft]
        shaft_diameter = shafts[bearing.shaft].diameter_at(bearing.z)
        rolling = bearing.name not in constant
        made.append(Support(bearing, z, estimate(unit, bearing, shaft_diameter, loads[bearing.name], rolling=rolling)))
    links = tuple(support for support in made if support.bearing.outer_shaft)
    for name, one, other in ((s.bearing.name, s.bearing.shaft, s.bearing.outer_shaft) for s in links):
        if (apart := dist(places.axes[one], places.axes[other])) >= COAXIAL:
            unit.findings.refuse(
                f"bearing {name}: its shafts {one} and {other} are {1e3 * apart:.4g} mm apart, not coaxial: correct "
                "support_vector, or center_distance of a stage"
            )
    groups: list[list[Support]] = []
    for support in sorted((s for s in made if not s.bearing.outer_shaft), key=lambda s: (s.bearing.shaft, s.z)):
        last = groups[-1][-1] if groups and groups[-1][-1].bearing.shaft == support.bearing.shaft else None
        if last is not None and support.z - last.z <= 0.5 * (last.estimate.width + support.estimate.width) + _SEAT_GAP:
            groups[-1].append(support)
        else:
            groups.append([support])
    seats = [_together(unit, group) if len(group) > 1 else group[0] for group in groups]
    for shaft in unit.shafts:
        held = [s for s in seats if s.bearing.shaft == shaft.name]
        joined = [s for s in links if shaft.name in (s.bearing.shaft, s.bearing.outer_shaft)]
        stiff = any(holds_tilt(s.estimate.model) for s in (*held, *joined))
        if len(held) + len(joined) < 2 and not stiff:
            unit.findings.refuse(
                f"shaft {shaft.name}: has bearings in {len(held) + len(joined)} plane(s), of 2 at least: it can tilt "
                "freely; add a bearing"
            )
        elif all(s.bearing.axial == "no_direction" for s in (*held, *joined)):
            unit.findings.refuse(
                f"shaft {shaft.name}: none of its {len(held)} bearing(s) holds it along its axis: set "
                "axial_force_absorption of one"
            )
    order = {bearing.name: number for number, bearing in enumerate(unit.bearings)}
    return tuple(sorted(seats, key=lambda s: order[s.bearing.name])), links


def _together(unit: GearUnit, group: Sequence[Support]) -> Support:
    """Return bearings beside each other as one: two alike as a pair, others as a spring with their stiffness added."""
    first, last = group[0], group[-1]
    each = [support.estimate for support in group]
    names = ", ".join(support.bearing.name for support in group[1:])
    held = {support.bearing.axial for support in group} - {"no_direction"}
    axial = held.pop() if len(held) == 1 else "both_directions" if held else "no_direction"
    model = paired(each[0].rolling, each[1].rolling, last.z - first.z) if len(group) == 2 else None
    radial = sum(one.radial_stiffness for one in each)
    if model is not None:
        centre, seat, source = 0.5 * (first.z + last.z), f": {model.arrangement}", each[0].source
        reason = "alike bearings beside each other are a pair"
    else:
        for support, own in zip(group, each, strict=True):
            if isinstance(own.model, StiffnessMatrix):
                text = f"{own.radial_stiffness:.3g} and {own.axial_stiffness:.3g} N/m radially and axially instead"
                unit.findings.add("excluded", support.bearing.name, "5 × 5 matrix", text, "another bearing beside it")
            if own.rolling is not None:
                text = f"{own.radial_stiffness:.3g} and {own.axial_stiffness:.3g} N/m"
                unit.findings.add("assumed", support.bearing.name, "radial and axial stiffness", text, own.source)
        centre = sum(support.estimate.radial_stiffness * support.z for support in group) / radial
        seat, source = "", f"{each[0].source}; with {names}"
        reason = "beside each other: stiffness added; their resistance to tilt is excluded"
    unit.findings.add("assumed", first.bearing.name, "seat", f"with {names}{seat}", reason)
    faces = [
        (support.z - 0.5 * own.width, support.z + 0.5 * own.width) for support, own in zip(group, each, strict=True)
    ]
    whole = BearingEstimate(
        min(one.bore for one in each),
        max(one.outer_diameter for one in each),
        max(high for _, high in faces) - min(low for low, _ in faces),
        radial,
        sum(one.axial_stiffness for one in each),
        source,
        model,
    )
    return Support(replace(first.bearing, axial=axial), centre, whole)


def _housing(
    unit: GearUnit,
    places: Arrangement,
    gears: dict[str, GearGeometry],
    cylinders: dict[str, list[Piece]],
    supports: Sequence[Support],
) -> DrawnCasting:
    """Return a casting drawn around everything."""
    shaft_of = {gear.name: gear.shaft for gear in unit.gears}
    discs = [
        DrawnDisc(
            places.axes[shaft_of[name]],
            places.planes[name] - 0.5 * gear.face_width,
            places.planes[name] + 0.5 * gear.face_width,
            gear.tip_circle_radius,
            gear=True,
        )
        for name, gear in gears.items()
    ]
    discs += [
        DrawnDisc(places.axes[name], piece.start, piece.end, 0.5 * piece.outer, gear=False)
        for name, found in cylinders.items()
        for piece in found
    ]
    seats = [
        DrawnSeat(s.bearing.name, places.axes[s.bearing.shaft], s.z, s.estimate.outer_diameter, s.estimate.width)
        for s in supports
    ]
    largest = max(places.distances.values())
    if unit.casing_material is None:
        return draw_casting(seats, discs, largest)
    return draw_casting(seats, discs, largest, Material(*unit.casing_material))


def _band(unit: GearUnit, gears: dict[str, GearGeometry], speed: float) -> tuple[float, float, float]:
    """Return lowest and highest line and their spacing (Hz): ten harmonics of the fastest mesh, 2 to 4 kHz."""
    fastest = max(
        (
            speed / (2 * pi) * gears[stage.pinion].teeth
            for stage in unit.stages
            if _sits_on(unit, stage.pinion, unit.input_shaft)
        ),
        default=0.0,
    )
    high = min(max(500.0 * ceil(10 * fastest / 500.0), 2000.0), 4000.0)
    return 50.0, high, 5.0


def microphone(case: ImportedCase) -> tuple[float, float, float]:
    """Return the place (m) of the microphone, 1 m beside the casting at the middle of its depth."""
    casting = case.drawn.casting
    outside = max(space.centre[0] + space.radius for space in casting.gear_spaces) + casting.wall + casting.draft
    ys = [y for space in casting.gear_spaces for y in (space.centre[1] - space.radius, space.centre[1] + space.radius)]
    return outside + 1.0, 0.5 * (min(ys) + max(ys)), 0.5 * casting.depth
