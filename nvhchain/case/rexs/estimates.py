"""Estimates for imported bearings: boundary dimensions by designation, and stiffness by a published formula."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import atan, cos, degrees, hypot, pi, radians, sin, tan

import numpy as np

from nvhchain.bearings.springs import StiffnessMatrix
from nvhchain.case.rexs.arranged import Arrangement
from nvhchain.case.rexs.designation import Sizes, light_sizes, named_sizes
from nvhchain.case.rexs.rolling import RIBS, Elements, RollingModel, rolling_model
from nvhchain.errors import InputError
from nvhchain.gear import GearGeometry
from nvhchain.gear.drawing.pair import common_face
from nvhchain.interop.rexs import GearUnit, ImportedBearing

RIGID = 1e10
"""Stiffness (N/m) in place of a larger one, which a file writes for a rigid bearing."""

FREE = 1e4
"""Axial stiffness (N/m) of a bearing that does not hold its shaft along z."""

_ANGLES = {
    "tapered": 14.0,
    "angular": 25.0,
    "spherical": 10.0,
    "self_aligning": 10.0,
    "grooved": 12.0,
    "four_point": 35.0,
}
"""Contact angle (°) by a word in the type; it sets the axial stiffness."""


@dataclass(frozen=True)
class BearingEstimate:
    """Dimensions and stiffness of a bearing.

    bore, outer_diameter, width : boundary dimensions (m).
    radial_stiffness, axial_stiffness : stiffness (N/m); without effect beside a model.
    """

    bore: float
    outer_diameter: float
    width: float
    radial_stiffness: float
    axial_stiffness: float
    source: str
    model: RollingModel | StiffnessMatrix | None = None

    @property
    def rolling(self) -> RollingModel | None:
        """Rolling elements; None for springs and a matrix."""
        return None if isinstance(self.model, StiffnessMatrix) else self.model


def estimate(
    unit: GearUnit, bearing: ImportedBearing, shaft_diameter: float, load: float, *, rolling: bool
) -> BearingEstimate:
    """Return dimensions of a bearing, and its rolling elements or stiffness; estimates go into the record.

    shaft_diameter : diameter of its shaft (m).
    load : radial load (N).
    """
    bore, outer, width = _dimensions(unit, bearing, shaft_diameter)
    kind = _kind(unit, bearing)
    angle = _contact_angle(bearing, kind)
    radial, axial, source = bearing.radial_stiffness, bearing.axial_stiffness, "stiffness in the file"
    if rolling and (matrix := _operating(unit, bearing)) is not None:
        return BearingEstimate(bore, outer, width, radial or FREE, axial or FREE, "operating point in the file", matrix)
    if radial is None or (axial is None and bearing.axial != "no_direction"):
        inside = _elements(bearing, kind, bore, outer, width)
        count = inside.count * (bearing.rows or 1)
        own = _kraemer(kind, count, inside.diameter, inside.length, load, angle)
        estimated_axial, rule = _axial_stiffness(bearing, kind, angle, own)
        if radial is None and axial is None and rolling and kind == bearing.kind:
            model = rolling_model(unit, bearing, (bore, outer, width), inside, angle, own)
            if model is not None:
                return BearingEstimate(bore, outer, width, own, estimated_axial, "E. Krämer 1993", model)
        if radial is None:
            radial = own
            size = 1e3 * inside.diameter
            source = f"E. Krämer 1993, {kind} with {count:.0f} elements of {size:.3g} mm at {1e-3 * load:.3g} kN"
            text = f"{source}; {inside.source}"
            unit.findings.add("assumed", bearing.name, "radial stiffness", f"{radial:.3g} N/m", text)
        if axial is None and bearing.axial != "no_direction":
            axial = estimated_axial
            unit.findings.add("assumed", bearing.name, "axial stiffness", f"{axial:.3g} N/m", rule)
    if bearing.axial == "no_direction":
        axial = FREE
        unit.findings.add("assumed", bearing.name, "axial stiffness", f"{FREE:g} N/m", "holds its shaft radially only")
    for way, play in (("radial", bearing.clearance), ("axial", bearing.axial_clearance)):
        if play:
            unit.findings.add("excluded", bearing.name, f"{way} clearance", f"{1e6 * play:.4g} µm", "linear springs")
    if bearing.axial in ("positive", "negative"):
        unit.findings.add(
            "assumed", bearing.name, "axial support", f"{bearing.axial} only", "linear, in both directions"
        )
    limited = [min(max(value or FREE, FREE), RIGID) for value in (radial, axial)]
    return BearingEstimate(bore, outer, width, limited[0], limited[1], source)


def _operating(unit: GearUnit, bearing: ImportedBearing) -> StiffnessMatrix | None:
    """Return the stiffness of a bearing at the operating point of the file; None without one that a case can have.

    A bearing that holds its shaft radially only has no axial stiffness.
    """
    if bearing.matrix is None:
        return None
    values = np.array(bearing.matrix)
    if bearing.axial == "no_direction":
        values[2], values[:, 2] = 0.0, 0.0
    try:
        matrix = StiffnessMatrix(tuple(map(tuple, values.tolist())))
    except InputError as error:
        text = f"not used: {error}"
        unit.findings.add("differs", bearing.name, "stiffness at the operating point", text, "means taken")
        return None
    unit.findings.add("taken", bearing.name, "stiffness", "5 × 5 matrix", "operating point in the file")
    return matrix


_SUFFIX = re.compile(r"(?<!\d)(B?)7\d{2,4}[- ]?(A5|AC|AD|A|B|C|(?<=[- ])E)[A-Z0-9]*(?![a-z])")
_SUFFIX_ANGLES = {"A5": 25.0, "AC": 25.0, "AD": 25.0, "A": 30.0, "B": 40.0, "C": 15.0, "BE": 25.0}
"""Contact angle (degrees) by the first letters after the number of an angular contact bearing.

As in catalogues of SKF, Schaeffler (E after B7…: 25°) and NSK (A: 30°, A5: 25°).
"""


def _axial_stiffness(bearing: ImportedBearing, kind: str, angle: float, radial: float) -> tuple[float, str]:
    """Return the axial stiffness (N/m) of a bearing of known radial stiffness, and the rule behind it."""
    if bearing.axial == "no_direction":
        return FREE, "holds its shaft radially only"
    if kind in ("radial_roller_bearing", "radial_needle_roller_bearing"):
        return max(RIBS * radial, FREE), "ribs: a tenth of the radial stiffness"
    return max(2.0 * tan(angle) ** 2 * radial, FREE), f"contact angle {degrees(angle):.3g}°, k_a = 2 tan²α k_r"


def _kind(unit: GearUnit, bearing: ImportedBearing) -> str:
    """Return the type; that of a concept bearing follows its axial support."""
    if bearing.kind != "concept_bearing" and "rolling_bearing_with" not in bearing.kind:
        return bearing.kind
    guess = {"no_direction": "radial_roller_bearing", "both_directions": "radial_grooved_ball_bearing"}
    kind = guess.get(bearing.axial, "radial_tapered_roller_bearing")
    if bearing.radial_stiffness is None:
        unit.findings.add("assumed", bearing.name, "type", kind, "by its axial support; none given")
    return kind


def _contact_angle(bearing: ImportedBearing, kind: str) -> float:
    """Return the contact angle (rad) in the file, or the usual one of the type."""
    if bearing.contact_angle:
        return abs(bearing.contact_angle)
    words = " ".join(bearing.catalogue.get(key, "") for key in ("catalogue_designation", "name"))
    suffix = _SUFFIX.search(words) if "angular" in kind else None
    letters = "" if suffix is None else suffix[1] + suffix[2] if suffix[2] == "E" else suffix[2]
    if letters in _SUFFIX_ANGLES:
        return radians(_SUFFIX_ANGLES[letters])
    return radians(next((angle for word, angle in _ANGLES.items() if word in kind), 0.0))


def _dimensions(unit: GearUnit, bearing: ImportedBearing, shaft_diameter: float) -> tuple[float, float, float]:
    """Return bore, outer diameter and width (m): of the file, by the designation, or of the light series."""
    bore, outer, width = bearing.bore, bearing.outer_diameter, bearing.width
    if bore and outer and width and bore < outer:
        return bore, outer, width
    named, source = named_sizes(bearing.catalogue.get("catalogue_designation", "")), "by its designation and ISO 15"
    if named is None:
        named, source = _named_dimensions(bearing, bore or shaft_diameter), "by its name in the file and ISO 15"
    if named is not None and shaft_diameter and abs(named[0] - shaft_diameter) > 0.2 * shaft_diameter:
        text = f"bore {1e3 * named[0]:.4g} mm by its designation, shaft {1e3 * shaft_diameter:.4g} mm"
        unit.findings.add("differs", bearing.name, "designation", text, "not used; is a sleeve missing in the file?")
        named = None
    if named is None:
        named, source = light_sizes(bore or shaft_diameter or 0.02), "dimension series 02 of ISO 15 on its shaft"
    bore = bore or named[0]
    outer = outer if outer and outer > bore else max(named[1], 1.15 * bore)
    if not width and named[2] is None:
        source += "; width half of D - d"
    width = width or named[2] or 0.5 * (outer - bore)
    text = f"{1e3 * bore:.4g} x {1e3 * outer:.4g} x {1e3 * width:.4g} mm"
    unit.findings.add("assumed", bearing.name, "bore, outer diameter, width", text, source)
    return bore, outer, width


def _named_dimensions(bearing: ImportedBearing, bore: float) -> Sizes | None:
    """Return the dimensions (m) of a designation in a bearing's name whose bore is that of its shaft."""
    for word in re.findall(
        r"\d+\s*[xX×]\s*\d+\s*[xX×]\s*\d+|\b[A-Z]{0,3}[ -]?\d{3,5}\b", bearing.catalogue.get("name", "")
    ):
        found = named_sizes(word)
        if found is not None and abs(found[0] - bore) < 1e-3:
            return found
    return None


def _elements(bearing: ImportedBearing, kind: str, bore: float, outer: float, width: float) -> Elements:
    """Return the rolling elements of a row."""
    ball = "ball" in kind
    needle = "needle" in kind
    pitch = 0.5 * (bore + outer)
    size = (0.3 if ball else 0.35 if needle else 0.25) * (outer - bore)
    count = (0.6 if ball else 0.85) * pi * pitch / size
    share = 0.35 if "self_aligning_roller" in kind else 0.6  # of the width; two rows share it
    source = "0.3 (D - d), 60 % filled" if ball else f"0.25 (D - d), 85 % filled, {share:g} B long"
    if bearing.element_diameter:
        size = bearing.element_diameter
        count, source = (0.6 if ball else 0.85) * pi * pitch / size, "element diameter in the file"
    if bearing.elements:
        count, source = float(bearing.elements), f"{bearing.elements} elements in the file"
    length = bearing.element_length or share * width
    return Elements(count, size, length, source)


def _kraemer(kind: str, count: float, size: float, length: float, load: float, angle: float) -> float:
    """Return the radial stiffness (N/m) of a rolling bearing under load.

    E. Krämer, Dynamics of Rotors and Foundations, 1993. Balls: 13e6 Z^(2/3) D_w^(1/3) F^(1/3) cos^(5/3) α. Rollers:
    1e9 Z^0.9 L^0.8 F^0.1 cos^1.9 α. SI units.
    """
    if "ball" in kind:
        return float(13e6 * count ** (2 / 3) * size ** (1 / 3) * load ** (1 / 3) * cos(angle) ** (5 / 3))
    return float(1e9 * count**0.9 * length**0.8 * load**0.1 * cos(angle) ** 1.9)


def bearing_loads(
    unit: GearUnit, arrangement: Arrangement, gears: dict[str, GearGeometry], torque: float
) -> dict[str, float]:
    """Return an estimate of the radial load (N) of every bearing: rigid shafts on equal springs.

    torque : torque of the input (N m).
    """
    shaft_of = {gear.name: gear.shaft for gear in unit.gears}
    turns = {unit.input_shaft: 1.0}
    pushes: dict[str, list[tuple[float, float, float]]] = {shaft.name: [] for shaft in unit.shafts}
    for _ in unit.stages:
        for stage in unit.stages:
            if shaft_of[stage.pinion] in turns:
                ratio = gears[stage.pinion].teeth / gears[stage.wheel].teeth
                turns.setdefault(shaft_of[stage.wheel], -turns[shaft_of[stage.pinion]] * ratio)
    for stage in unit.stages:
        pinion, one, other = gears[stage.pinion], shaft_of[stage.pinion], shaft_of[stage.wheel]
        speed = turns.get(one, 1.0)
        (x1, y1), (x2, y2) = arrangement.axes[one], arrangement.axes[other]
        apart = hypot(x2 - x1, y2 - y1)
        ex, ey = (x2 - x1) / apart, (y2 - y1) / apart
        tangential = torque / abs(speed) / pinion.pitch_radius
        radial = tangential * tan(pinion.normal_pressure_angle) / cos(atan(sin(pinion.helix_angle)))
        sense = 1.0 if speed * unit.input_rotation > 0 else -1.0
        fx, fy = sense * tangential * ey - radial * ex, -sense * tangential * ex - radial * ey
        pair = stage.pinion, stage.wheel
        plane = 0.5 * sum(
            common_face([arrangement.planes[name] for name in pair], [arrangement.widths[name] for name in pair])
        )
        pushes[one].append((plane, fx, fy))
        pushes[other].append((plane, -fx, -fy))
    loads = {bearing.name: 100.0 for bearing in unit.bearings}
    for shaft in unit.shafts:
        held = [b for b in unit.bearings if shaft.name in (b.shaft, b.outer_shaft)]
        if not held or not pushes[shaft.name]:
            continue
        places = np.array([b.z + arrangement.shifts[b.shaft] for b in held])
        rows = np.stack([np.ones(len(places)), places], axis=1)
        for bearing, reaction in zip(held, _reactions(rows, pushes[shaft.name]), strict=True):
            loads[bearing.name] = max(loads[bearing.name], reaction)
    return loads


def _reactions(rows: np.ndarray, pushes: list[tuple[float, float, float]]) -> np.ndarray:
    """Return the size (N) of the reactions on equal springs at `rows` (1, z)."""
    forces = np.array([[fx, fy] for _, fx, fy in pushes])
    arms = np.array([[1.0, z] for z, _, _ in pushes])
    motion = np.linalg.lstsq(rows.T @ rows, arms.T @ forces, rcond=None)[0]
    return np.asarray(np.linalg.norm(rows @ motion, axis=1))
