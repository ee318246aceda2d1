"""Gear unit in neutral terms: shafts, gears, stages, bearings and load, in SI units.

Frame: z along the shafts, the u axis of the first shaft; x and y are its v and w axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from nvhchain.interop.rexs.contents.findings import Findings


@dataclass(frozen=True)
class Section:
    """Piece of a shaft; diameters may differ at its ends.

    Parameters
    ----------
    start, end : float
        Planes (m).
    outer, inner : tuple of 2 float
        Diameters at start and end (m).
    young, poisson, density : float
        Material (Pa; kg/m³).
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

    Parameters
    ----------
    shaft : str
        Shaft.
    z : float
        Place (m).
    force : tuple of 3 float
        Force along x, y, z (N).
    moment : tuple of 2 float
        Moment about x and y (N m).
    """

    shaft: str
    z: float
    force: tuple[float, float, float]
    moment: tuple[float, float]


@dataclass(frozen=True)
class ImportedMass:
    """Mass on a shaft: a flange, a coupling half, a rotor.

    Parameters
    ----------
    z : float
        Centre of mass (m).
    mass, polar_inertia, transverse_inertia : float
        Mass (kg) and moments of inertia about the axis and across it (kg m²).
    """

    z: float
    mass: float
    polar_inertia: float
    transverse_inertia: float


@dataclass(frozen=True)
class ImportedShaft:
    """Shaft.

    Parameters
    ----------
    name : str
        Name.
    axis : tuple of 2 float, optional
        Place of the axis x, y (m).
    sections : tuple of Section
        Pieces.
    masses : tuple of ImportedMass
        Additional masses.
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

    Parameters
    ----------
    amount : float
        Amount at the end (m).
    length : float, optional
        Rolled length (m).
    diameter : float, optional
        Diameter of its start (m), in place of the length.
    shape : str
        Shape in REXS.
    """

    amount: float
    length: float | None
    diameter: float | None
    shape: str


@dataclass(frozen=True)
class FlankShape:
    """Modifications of one flank.

    Parameters
    ----------
    tip_relief, root_relief : ImportedRelief, optional
        Reliefs.
    profile_crowning, lead_crowning : float
        Amounts (m).
    """

    tip_relief: ImportedRelief | None = None
    root_relief: ImportedRelief | None = None
    profile_crowning: float = 0.0
    lead_crowning: float = 0.0


@dataclass(frozen=True)
class ImportedGear:
    """Cylindrical gear; None marks what the file leaves open.

    Parameters
    ----------
    name, shaft : str
        Names.
    z : float, optional
        Mid-plane (m).
    teeth : int
        Number of teeth.
    module : float
        Normal module (m).
    pressure_angle, helix_angle : float
        Normal pressure angle and helix angle (rad), > 0 right-handed.
    face_width : float
        Face width (m).
    profile_shift : float, optional
        Profile shift (normal modules).
    addendum, dedendum, rack_tip_radius : float, optional
        Basic profile (normal modules).
    tip_radius, root_radius, bore_radius : float, optional
        Circles (m).
    allowance : float, optional
        Reduction of the normal tooth thickness (m).
    thickness : float, optional
        Normal tooth thickness at the reference circle (m).
    span : tuple of (float, int), optional
        Base tangent length (m) and the teeth that it spans.
    ball_size : tuple of (float, float, str), optional
        Dimension over balls or pins (m), their diameter (m), and `balls` or `pins`.
    ball_deviation, ball : float, optional
        Mean deviation of the dimension over balls or pins, and their diameter (m).
    tip_chamfer : float
        Radial height of the tip chamfer (m).
    protuberance : tuple of (float, float, float or None), optional
        Amount and machining allowance (m), and angle (rad, None where the file has none) of the tool's protuberance.
    flanks : tuple of 2 FlankShape
        Left and right flank.
    loaded_flanks : dict
        Stage → `left` or `right`, where the file names the loaded flank.
    young, poisson, density : float
        Material (Pa; kg/m³).
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

    Parameters
    ----------
    name, pinion, wheel : str
        Names; the pinion drives.
    centre_distance : float, optional
        Centre distance (m).
    angle : float, optional
        Direction of the wheel's axis from that of the pinion, from +y towards +x (rad).
    backlash : float, optional
        Mean normal backlash (m).
    circumferential_backlash : float, optional
        Mean backlash in the transverse section (m).
    shift_sum : float, optional
        Sum of the profile shifts (normal modules).
    stated : dict
        Results in the file for comparison: `contact_ratio`, `overlap_ratio`, `total_contact_ratio`,
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

    Parameters
    ----------
    name, shaft : str
        Names.
    outer_shaft : str
        Shaft around it; empty for the casing.
    z : float
        Mid-plane (m).
    kind : str
        Type in REXS, such as `radial_grooved_ball_bearing`; `concept_bearing` without one.
    bore, outer_diameter, width : float, optional
        Boundary dimensions (m).
    radial_stiffness, axial_stiffness : float, optional
        Stiffness in the file (N/m).
    matrix : tuple of 5 tuples of 5 float, optional
        Stiffness at the operating point for x, y, z, θx, θy (N/m, N, N m), where it is more than these two.
    axial : str
        Axial support along z, `both_directions`, `positive`, `negative` or `no_direction`.
    elements, rows : int, optional
        Rolling elements of a row, and rows.
    row_distance : float, optional
        Distance of neighbouring rows (m).
    element_diameter, element_length : float, optional
        Sizes of the rolling elements (m); of rollers the length in contact, where the file has it.
    pitch_diameter, inner_groove_radius, outer_groove_radius : float, optional
        Circle of element centres, and radii of the grooves of a ball bearing (m).
    contact_angle : float, optional
        Contact angle (rad).
    dynamic_load_rating, static_load_rating : float, optional
        Radial load ratings (N).
    clearance : float, optional
        Radial clearance (m), in operation where the file states it.
    axial_clearance : float
        Axial clearance in operation (m), < 0 for a preload distance.
    catalogue : dict
        All these and other data as they stand in the file, in the words of REXS.
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

    Parameters
    ----------
    name : str
        Number in the file.
    speed : float, optional
        Speed of the input (rad/s), ≥ 0.
    torque : float, optional
        Torque of the input along its rotation (N m); negative where it coasts.
    share : float, optional
        Share of the operating time.
    reversed : bool
        True where the input turns against its rotation in the chosen load case.
    """

    name: str
    speed: float | None
    torque: float | None
    share: float | None = None
    reversed: bool = False


@dataclass(frozen=True)
class GearUnit:
    """Parallel-shaft gear unit.

    Parameters
    ----------
    name, version, application : str
        Name; version of REXS and program that wrote the file.
    shafts : tuple of ImportedShaft
        Shafts.
    gears : tuple of ImportedGear
        Gears.
    stages : tuple of ImportedStage
        Stages, from the input.
    bearings : tuple of ImportedBearing
        Bearings.
    input_shaft, output_shaft : str
        Names of the shafts.
    input_rotation : int
        +1 where the input turns by the right-hand rule about +z, else −1.
    loads : tuple of ImportedLoad
        Load cases; the first is the chosen one.
    casing_material : tuple of 3 float, optional
        Young's modulus (Pa), Poisson's ratio and density (kg/m³).
    findings : Findings
        Record of the import.
    side_loads : tuple of ImportedSideLoad
        Forces and moments from outside, of the chosen load case.
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
