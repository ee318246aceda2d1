"""Gear unit in neutral terms: shafts, gears, stages, bearings and load, in SI units.

Frame: z along the shafts, the u axis of the first shaft; x and y are its v and w axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from nvhchain.interop.rexs.contents.findings import Findings


@dataclass(frozen=True)
class Section:
    """Piece of a shaft; diameters may differ at its ends.

    start, end: planes (m).
    outer, inner: diameters at start and end (m).
    young, poisson, density: material (Pa; kg/m³).
    """

    start: float
    end: float
    outer: tuple[float, float]
    inner: tuple[float, float]
    young: float = 210e9
    poisson: float = 0.3
    density: float = 7850.0


@dataclass(frozen=True)
class ImportedSideLoad:
    """Force and moment from outside on a shaft.

    z: place (m).
    force: force along x, y, z (N).
    moment: moment about x and y (N m).
    """

    shaft: str
    z: float
    force: tuple[float, float, float]
    moment: tuple[float, float]


@dataclass(frozen=True)
class ImportedMass:
    """Mass on a shaft: a flange, a coupling half, a rotor.

    z: centre of mass (m).
    mass, polar_inertia, transverse_inertia: mass (kg) and moments of inertia about the axis and across it (kg m²).
    """

    z: float
    mass: float
    polar_inertia: float
    transverse_inertia: float


@dataclass(frozen=True)
class ImportedShaft:
    """Shaft.

    axis: place of the axis x, y (m).
    sections: pieces.
    masses: additional masses.
    """

    name: str
    axis: tuple[float, float] | None
    sections: tuple[Section, ...]
    masses: tuple[ImportedMass, ...] = ()

    def diameter_at(self, z: float) -> float:
        """Return the outer diameter (m) at a plane, or that of the nearest piece.

        z: plane (m).
        Returns diameter (m); 0 without pieces.
        """
        inside = [max(piece.outer) for piece in self.sections if piece.start <= z <= piece.end]
        if inside:
            return max(inside)
        near = min(self.sections, key=lambda s: min(abs(s.start - z), abs(s.end - z)), default=None)
        return max(near.outer) if near else 0.0


@dataclass(frozen=True)
class ImportedRelief:
    """Relief of a tip or root.

    amount: amount at the end (m).
    length: rolled length (m).
    diameter: diameter of its start (m), in place of the length.
    shape: shape in REXS.
    """

    amount: float
    length: float | None
    diameter: float | None
    shape: str


@dataclass(frozen=True)
class FlankShape:
    """Modifications of one flank.

    tip_relief, root_relief: reliefs.
    profile_crowning, lead_crowning: amounts (m).
    """

    tip_relief: ImportedRelief | None = None
    root_relief: ImportedRelief | None = None
    profile_crowning: float = 0.0
    lead_crowning: float = 0.0


@dataclass(frozen=True)
class ImportedGear:
    """Cylindrical gear; None marks what the file leaves open.

    name, shaft: names.
    z: mid-plane (m).
    teeth: number of teeth.
    module: normal module (m).
    pressure_angle, helix_angle: normal pressure angle and helix angle (rad), > 0 right-handed.
    face_width: face width (m).
    profile_shift: profile shift (normal modules).
    addendum, dedendum, rack_tip_radius: basic profile (normal modules).
    tip_radius, root_radius, bore_radius: circles (m).
    allowance: reduction of the normal tooth thickness (m).
    thickness: normal tooth thickness at the reference circle (m).
    span: base tangent length (m) and the teeth that it spans.
    ball_size: dimension over balls or pins (m), their diameter (m), and `balls` or `pins`.
    ball_deviation, ball: mean deviation of the dimension over balls or pins, and their diameter (m).
    tip_chamfer: radial height of the tip chamfer (m).
    protuberance: amount and machining allowance (m), and angle (rad, None where the file has none) of the tool's
        protuberance.
    flanks: left and right flank.
    loaded_flanks: stage → `left` or `right`, where the file names the loaded flank.
    young, poisson, density: material (Pa; kg/m³).
    """

    name: str
    shaft: str
    z: float | None
    teeth: int
    module: float
    pressure_angle: float
    helix_angle: float
    face_width: float
    profile_shift: float | None = None
    addendum: float | None = None
    dedendum: float | None = None
    rack_tip_radius: float | None = None
    tip_radius: float | None = None
    root_radius: float | None = None
    bore_radius: float | None = None
    allowance: float | None = None
    thickness: float | None = None
    span: tuple[float, int] | None = None
    ball_size: tuple[float, float, str] | None = None
    ball_deviation: float | None = None
    ball: float | None = None
    tip_chamfer: float = 0.0
    protuberance: tuple[float, float, float | None] | None = None
    flanks: tuple[FlankShape, FlankShape] = (FlankShape(), FlankShape())
    loaded_flanks: dict[str, str] = field(default_factory=dict)
    young: float = 210e9
    poisson: float = 0.3
    density: float = 7850.0


@dataclass(frozen=True)
class ImportedStage:
    """Gear stage.

    name, pinion, wheel: names; the pinion drives.
    centre_distance: centre distance (m).
    angle: direction of the wheel's axis from that of the pinion, from +y towards +x (rad).
    backlash: mean normal backlash (m).
    circumferential_backlash: mean backlash in the transverse section (m).
    shift_sum: sum of the profile shifts (normal modules).
    stated: results in the file for comparison: `contact_ratio`, `overlap_ratio`, `total_contact_ratio`,
        `working_pressure_angle` (rad), `common_face_width` (m).
    """

    name: str
    pinion: str
    wheel: str
    centre_distance: float | None
    angle: float | None = None
    backlash: float | None = None
    circumferential_backlash: float | None = None
    shift_sum: float | None = None
    stated: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class ImportedBearing:
    """Bearing between a shaft and the casing, or between two shafts.

    name, shaft: names.
    outer_shaft: shaft around it; empty for the casing.
    z: mid-plane (m).
    kind: type in REXS, such as `radial_grooved_ball_bearing`; `concept_bearing` without one.
    bore, outer_diameter, width: boundary dimensions (m).
    radial_stiffness, axial_stiffness: stiffness in the file (N/m).
    matrix: stiffness at the operating point for x, y, z, θx, θy (N/m, N, N m), where it is more than these two.
    axial: axial support along z, `both_directions`, `positive`, `negative` or `no_direction`.
    elements, rows: rolling elements of a row, and rows.
    row_distance: distance of neighbouring rows (m).
    element_diameter, element_length: sizes of the rolling elements (m); of rollers the length in contact, where the
        file has it.
    pitch_diameter, inner_groove_radius, outer_groove_radius: circle of element centres, and radii of the grooves of a
        ball bearing (m).
    contact_angle: contact angle (rad).
    dynamic_load_rating, static_load_rating: radial load ratings (N).
    clearance: radial clearance (m), in operation where the file states it.
    axial_clearance: axial clearance in operation (m), < 0 for a preload distance.
    catalogue: all these and other data as they stand in the file, in the words of REXS.
    """

    name: str
    shaft: str
    outer_shaft: str
    z: float
    kind: str
    bore: float | None = None
    outer_diameter: float | None = None
    width: float | None = None
    radial_stiffness: float | None = None
    axial_stiffness: float | None = None
    matrix: tuple[tuple[float, ...], ...] | None = None
    axial: str = "both_directions"
    elements: int | None = None
    rows: int | None = None
    row_distance: float | None = None
    element_diameter: float | None = None
    element_length: float | None = None
    pitch_diameter: float | None = None
    inner_groove_radius: float | None = None
    outer_groove_radius: float | None = None
    contact_angle: float | None = None
    dynamic_load_rating: float | None = None
    static_load_rating: float | None = None
    clearance: float | None = None
    axial_clearance: float = 0.0
    catalogue: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ImportedLoad:
    """Load case.

    name: number in the file.
    speed: speed of the input (rad/s), ≥ 0.
    torque: torque of the input along its rotation (N m); negative where it coasts.
    share: share of the operating time.
    reversed: True where the input turns against its rotation in the chosen load case.
    """

    name: str
    speed: float | None
    torque: float | None
    share: float | None = None
    reversed: bool = False


@dataclass(frozen=True)
class GearUnit:
    """Parallel-shaft gear unit.

    name, version, application: name; version of REXS and program that wrote the file.
    stages: stages, from the input.
    input_shaft, output_shaft: names of the shafts.
    input_rotation: +1 where the input turns by the right-hand rule about +z, else −1.
    loads: load cases; the first is the chosen one.
    casing_material: Young's modulus (Pa), Poisson's ratio and density (kg/m³).
    findings: record of the import.
    side_loads: forces and moments from outside, of the chosen load case.
    """

    name: str
    version: str
    application: str
    shafts: tuple[ImportedShaft, ...]
    gears: tuple[ImportedGear, ...]
    stages: tuple[ImportedStage, ...]
    bearings: tuple[ImportedBearing, ...]
    input_shaft: str
    output_shaft: str
    input_rotation: int
    loads: tuple[ImportedLoad, ...]
    casing_material: tuple[float, float, float] | None
    findings: Findings
    side_loads: tuple[ImportedSideLoad, ...] = ()
