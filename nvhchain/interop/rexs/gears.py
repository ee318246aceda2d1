"""Cylindrical gears of a document: macro-geometry, tool and flank modifications."""

from __future__ import annotations

from math import atan, cos, pi, sin, tan

from nvhchain.interop.rexs.contents.document import Component
from nvhchain.interop.rexs.contents.values import Values
from nvhchain.interop.rexs.parts import MODIFICATIONS, TOOLS, Parts
from nvhchain.interop.rexs.thickness import thickness_of
from nvhchain.interop.rexs.unit import FlankShape, ImportedGear, ImportedRelief

_LARGEST_CHAMFER = 0.3
"""Largest height of a tip chamfer (normal modules); a flank that ends further below counts as a lower tip."""


def read_gear(
    parts: Parts, component: Component, mate: Component | None, z: float | None, *, opposite: bool
) -> ImportedGear | None:
    """Return a gear; mistakes go into the record.

    mate: gear that meshes with it, for data that both share.
    opposite: True for a gear of the other hand than the first of its train, where hands are not stated.
    z: mid-plane (m).
    Returns gear; None if teeth, module or face width are missing.
    """
    record, values = parts.findings, parts.values(component)
    shaft = parts.shaft_of(component)
    teeth = values.number("number_of_teeth")
    helix = _helix(parts, component, mate, opposite=opposite)
    module = _module(parts, component, mate, helix)
    width = values.number("face_width", "m", low=1e-5)
    if teeth is not None and teeth < 0:
        record.refuse(f"internal gears are not modelled: {component.label} with {teeth:g} teeth: leave it out")
    if teeth is not None and teeth >= 0 and (teeth < 1 or teeth != round(teeth)):
        record.refuse(f"{component.label}: number_of_teeth = {teeth:g} is no whole number: correct it")
    for name, value in (("number_of_teeth", teeth), ("normal_module", module), ("face_width", width)):
        if value is None and name not in values:
            record.refuse(f"{component.label}: {name} is missing: add it")
    if teeth is None or teeth < 0 or module is None or width is None or shaft is None:
        return None
    flanks = _flanks(parts, component)
    tools = _tools(parts, component, flanks)
    angle = _pressure_angle(parts, component, mate, flanks, helix)
    pitch = module * teeth / cos(helix)
    name = parts.names[component.id]
    tip, chamfer = _tip(parts, component, flanks, pitch, module)
    return ImportedGear(
        name=name,
        shaft=parts.names[parts.rotor[shaft]],
        z=z,
        teeth=round(teeth),
        module=module,
        pressure_angle=angle,
        helix_angle=helix,
        face_width=width,
        profile_shift=_profile_shift(parts, name, flanks, [*flanks, values, *tools], module),
        addendum=_first(flanks, "addendum_coefficient_basic_profile"),
        dedendum=_tool_depth(tools, module),
        rack_tip_radius=_tool_radius(tools, module),
        tip_radius=tip,
        tip_chamfer=chamfer,
        root_radius=_circle(parts, component, "root_diameter", pitch - 6 * module, pitch + 4 * module),
        bore_radius=_circle(parts, component, "inner_diameter", 1e-3, pitch - 2 * module),
        protuberance=_protuberance(parts, name, flanks, tools, module),
        flanks=_shapes(parts, name, flanks, pitch, angle, helix),
        loaded_flanks=_loaded_flanks(parts, component),
        **(thickness_of(parts, component, angle, helix, pitch) | material_of(parts, component)),
    )


def material_of(parts: Parts, component: Component) -> dict[str, float]:
    """Return Young's modulus, Poisson's ratio and density of a component's material, those of steel by default.

    Returns `young` (Pa), `poisson`, `density` (kg/m³).
    """
    found = {"young": 210e9, "poisson": 0.3, "density": 7850.0}
    materials = parts.document.parts(component.id, "material")
    if not materials:
        parts.findings.add(
            "assumed", parts.names[component.id], "material", "steel: 210 GPa, 0.3, 7850 kg/m³", "none given"
        )
        return found
    values = parts.values(materials[0])
    for key, name, unit, low, high in (
        ("young", "elastic_modulus", "Pa", 1e6, 1e15),
        ("poisson", "poisson_ratio", "", 0.0, 0.499),
        ("density", "density", "kg/m³", 10.0, 3e4),
    ):
        value = values.number(name, unit, low=low, high=high)
        if value is not None:
            found[key] = value
    return found


def _helix(parts: Parts, component: Component, mate: Component | None, *, opposite: bool) -> float:
    """Return the helix angle (rad): its own, or that of its mate with the opposite hand; 0 without any."""
    name, record = parts.names[component.id], parts.findings
    unsigned = tuple(map(int, parts.document.version.split("."))) < (1, 3)
    own = parts.values(component).number("helix_angle_reference_diameter", "rad", low=-1.5, high=1.5)
    other = parts.values(mate).number("helix_angle_reference_diameter", "rad", low=-1.5, high=1.5) if mate else None
    if own is None:
        if other is None:
            record.add("assumed", name, "helix angle", "0°", "none given")
            return 0.0
        return -abs(other) if unsigned and opposite else abs(other) if unsigned else -other
    if unsigned and opposite and (own > 0 if other is None else own * other > 0):
        record.add("assumed", name, "hand of the helix", "opposite to its mate", "REXS before 1.3 states no hand")
        return -own
    return own


def _module(parts: Parts, component: Component, mate: Component | None, helix: float) -> float | None:
    """Return the normal module (m): its own, by its reference circle, or that of its mate."""
    values = parts.values(component)
    module = values.number("normal_module", "m", low=1e-5, high=0.2)
    if module is None and (transverse := values.number("transverse_module", "m", low=1e-5, high=0.2)):
        module = transverse * cos(helix)
    if module is None:
        diameter, teeth = values.number("reference_diameter_cylindrical_gear", "m"), values.number("number_of_teeth")
        module = diameter * cos(helix) / teeth if diameter and teeth else None
    if module is None and mate is not None:
        module = parts.values(mate).number("normal_module", "m", low=1e-5, high=0.2)
    return module


def _flanks(parts: Parts, component: Component) -> list[Values]:
    """Return the readers of left and right flank; empty ones where the file has none."""
    found = []
    for side in ("left", "right"):
        ends = [relation.end(side) for relation in parts.document.related("flank", "gear", component.id)]
        flanks = [parts.document.components[end] for end in ends if end is not None]
        found.append(parts.values(flanks[0]) if flanks else Values(component, parts.findings, {}))
    return found


def _first(readers: list[Values], name: str, unit: str = "") -> float | None:
    """Return the first value that one of several components has."""
    return next((value for reader in readers if (value := reader.number(name, unit)) is not None), None)


def _tools(parts: Parts, component: Component, flanks: list[Values]) -> list[Values]:
    """Return the readers of tools and manufacturing settings, the first step first."""
    pieces = {component.id, *(flank.component.id for flank in flanks)}
    found = []
    for relation in sorted(parts.document.relations, key=lambda relation: relation.order):
        work = {"manufacturing_step": "workpiece", "ordered_reference": "origin", "reference": "origin"}  # up to 1.6
        role = work.get(relation.type)
        if role is not None and relation.end(role) in pieces:
            ends = [parts.document.components[end] for own_role, end in relation.refs if own_role != role]
            found += [parts.values(end) for end in ends if end.type in TOOLS or end.type.endswith("_settings")]
    return found


def _pressure_angle(
    parts: Parts, component: Component, mate: Component | None, flanks: list[Values], helix: float
) -> float:
    name = parts.names[component.id]
    readers = [*flanks, parts.values(component), *_tools(parts, component, flanks)]
    if mate is not None:
        readers += [*_flanks(parts, mate), parts.values(mate)]
    angle = _first(readers, "normal_pressure_angle", "rad")
    if angle is None and (transverse := _first(flanks, "pressure_angle_in_the_transverse_section", "rad")):
        angle = atan(tan(transverse) * cos(helix))
    _compare_sides(parts, name, flanks, "normal_pressure_angle", "rad")
    if angle is None:
        parts.findings.add("assumed", name, "normal pressure angle", "20°", "ISO 53; none given")
        return pi / 9
    return angle


def _profile_shift(parts: Parts, name: str, flanks: list[Values], readers: list[Values], module: float) -> float | None:
    """Return the profile shift (normal modules), the generated one where no nominal one is given."""
    _compare_sides(parts, name, flanks, "addendum_modification_coefficient", "")
    shift = _first(readers, "addendum_modification_coefficient")
    if shift is None and (length := _first(readers, "addendum_modification", "m")) is not None:
        shift = length / module
    if shift is None and (generated := _first(readers, "generated_addendum_modification_coefficient")) is not None:
        parts.findings.add(
            "assumed", name, "profile shift x", f"{generated:.6g}", "the generated one; no nominal one given"
        )
        return generated
    return shift


def _compare_sides(parts: Parts, name: str, flanks: list[Values], quantity: str, unit: str) -> None:
    """Record that left and right flank differ; the left one is taken."""
    left, right = (flank.number(quantity, unit) for flank in flanks)
    if left is not None and right is not None and abs(left - right) > 1e-9 * max(abs(left), 1e-3):
        parts.findings.add("differs", name, quantity, f"left {left:.6g}, right {right:.6g} {unit}", "left flank taken")


def _tool_depth(tools: list[Values], module: float) -> float | None:
    """Return the dedendum that the tool cuts (normal modules)."""
    depth = _first(tools, "addendum_coefficient_reference_profile")
    if depth is None and (length := _first(tools, "addendum_reference_profile", "m")) is not None:
        depth = length / module
    return depth


def _protuberance(
    parts: Parts, name: str, flanks: list[Values], tools: list[Values], module: float
) -> tuple[float, float, float | None] | None:
    """Return amount and machining allowance (m) and angle (rad) of a tool's protuberance."""
    amount, remaining = _first(tools, "protuberance_amount", "m"), _first(flanks, "remaining_protuberance", "m")
    if amount is None and (factor := _first(tools, "protuberance_amount_factor")) is not None:
        amount = factor * module
    stock = _first(flanks, "grinding_allowance", "m") or _first(tools, "machining_allowance", "m") or 0.0
    amount = amount or remaining
    if not amount or amount < 0:
        return None
    if remaining is not None:
        stock = amount - remaining
    if not 0 <= stock <= amount:
        text = f"{1e3 * amount:.4g} mm with {1e3 * stock:.4g} mm of machining allowance"
        parts.findings.add("differs", name, "protuberance", text, "nothing is left of it: plain root")
        return None
    text = f"{1e3 * amount:.4g} mm, of which {1e3 * stock:.4g} mm are machined off"
    parts.findings.add("taken", name, "protuberance", text, "tool")
    return amount, stock, _first(tools, "protuberance_angle", "rad")


def _tool_radius(tools: list[Values], module: float) -> float | None:
    radius = _first(tools, "tip_corner_radius_factor_reference_profile")
    if radius is None and (length := _first(tools, "tip_corner_radius_reference_profile", "m")) is not None:
        radius = length / module
    return radius


def _circle(parts: Parts, component: Component, name: str, low: float, high: float) -> float | None:
    """Return half a diameter (m); one outside the limits is recorded and not used."""
    diameter = parts.values(component).number(name, "m")
    if diameter is None:
        return None
    if not low < diameter < high:
        if diameter > 0:
            parts.findings.add(
                "differs",
                parts.names.get(component.id, component.label),
                name,
                f"{1e3 * diameter:.6g} mm",
                f"not used: outside {1e3 * low:.5g}…{1e3 * high:.5g} mm, which fit teeth and module",
            )
        return None
    return 0.5 * diameter


def _tip(
    parts: Parts, component: Component, flanks: list[Values], pitch: float, module: float
) -> tuple[float | None, float]:
    """Return tip radius and height of the tip chamfer (m); a flank that ends far below the tip ends the tooth."""
    limits = pitch - 2 * module, pitch + 6 * module
    tip, gear = _circle(parts, component, "tip_diameter", *limits), parts.names[component.id]
    stages = parts.document.related("stage_gear_data", "gear", component.id)
    data = [parts.document.components[end] for r in stages if (end := r.end("stage_gear_data")) is not None]
    owners = [(component, "tip_form_diameter"), *((owner, "active_tip_diameter") for owner in (component, *data))]
    form, source = tip, ""
    for owner, name in owners:
        found = _circle(parts, owner, name, *limits)
        if found is not None and (form is None or found < form - 1e-9):
            form, source = found, name
    chamfer = _first(flanks, "tooth_tip_chamfer", "m") or 0.0
    if tip is not None and chamfer > 0 and (form is None or tip - chamfer < form - 1e-9):
        form, source = tip - chamfer, "tooth_tip_chamfer"
    if tip is None or form is None or not source:
        if source and form is not None:
            parts.findings.add("taken", gear, "tip circle", f"{2e3 * form:.6g} mm", f"{source}; the flank ends there")
        return form, 0.0
    if tip - form > _LARGEST_CHAMFER * module:
        parts.findings.add("taken", gear, "tip circle", f"{2e3 * form:.6g} mm", f"{source}; the flank ends there")
        return form, 0.0
    parts.findings.add("taken", gear, "tip chamfer", f"{1e3 * (tip - form):.4g} mm", source)
    return tip, tip - form


def _loaded_flanks(parts: Parts, component: Component) -> dict[str, str]:
    """Return the loaded flank, `left` or `right`, in every stage that names one."""
    found = {}
    for relation in parts.document.related("stage_gear_data", "gear", component.id):
        end, stage = relation.end("stage_gear_data"), relation.end("stage")
        flank = parts.values(parts.document.components[end]).text("loaded_tooth_flank") if end is not None else ""
        if flank in ("left", "right") and stage in parts.names:
            found[parts.names[stage]] = flank
    return found


def _shapes(
    parts: Parts, name: str, flanks: list[Values], pitch: float, angle: float, helix: float
) -> tuple[FlankShape, FlankShape]:
    """Return the modifications of left and right flank; kinds that the chain does not model are recorded."""
    left, right = (_shape(parts, name, flank, pitch, angle, helix) for flank in flanks)
    return left, right


def _shape(parts: Parts, name: str, flank: Values, pitch: float, angle: float, helix: float) -> FlankShape:
    found = {kind: None for kind in ("tip_relief", "root_relief", "profile_crowning", "helix_crowning")}
    readers: dict[str, Values | None] = dict(found)
    for part in parts.document.parts(flank.component.id, *found, *MODIFICATIONS):
        if part.type in MODIFICATIONS:
            why = "no such modification in the chain"
            if part.type == "helix_slope":
                why = "REXS does not say which way it turns: add lead_slope to the gear"
            parts.findings.add("excluded", name, part.type, part.label, why)
        elif readers[part.type] is None:
            readers[part.type] = parts.values(part)
        else:
            parts.findings.add("excluded", name, part.type, part.label, "one of each kind is taken")
    transverse = atan(tan(angle) / cos(helix))
    limit = 0.5 * pitch * sin(transverse)
    reliefs = {end: _relief(parts, name, readers[f"{end}_relief"], end, limit) for end in ("tip", "root")}
    return FlankShape(
        reliefs["tip"],
        reliefs["root"],
        _crowning(parts, name, readers["profile_crowning"], "profile_crowning_at_tip", "profile_crowning_at_root"),
        _crowning(
            parts,
            name,
            readers["helix_crowning"],
            "helix_crowning_amount_datum_face",
            "helix_crowning_amount_non_datum_face",
        ),
    )


def _relief(parts: Parts, name: str, values: Values | None, end: str, limit: float) -> ImportedRelief | None:
    if values is None:
        return None
    amount = values.number(f"{end}_relief_depth", "m", low=-1e-3, high=1e-3)
    length = values.number(f"{end}_relief_datum_length", "m", low=0.0, high=2 * limit)
    diameter = values.number(f"{end}_relief_datum_diameter", "m", low=1e-4)
    if not amount:
        return None
    if amount < 0 or not (length or diameter):
        why = "adds material" if amount < 0 else "has neither length nor diameter"
        parts.findings.add("excluded", name, f"{end} relief", f"{1e6 * amount:.4g} µm", why)
        return None
    return ImportedRelief(amount, length or None, diameter, values.text("shape_of_relief") or "linear")


def _crowning(parts: Parts, name: str, values: Values | None, first: str, second: str) -> float:
    """Return the mean amount (m) of a crowning at both ends."""
    if values is None:
        return 0.0
    ends = [values.number(end, "m", low=-1e-3, high=1e-3) for end in (first, second)]
    given = [value for value in ends if value is not None]
    mean = sum(given) / len(given) if given else 0.0
    if len(given) == 2 and abs(given[0] - given[1]) > 1e-8:
        text = f"{1e6 * given[0]:.4g} and {1e6 * given[1]:.4g} µm"
        parts.findings.add("assumed", name, first.partition("_amount")[0], text, "their mean at both ends")
    if mean < 0:
        parts.findings.add("excluded", name, first, f"{1e6 * mean:.4g} µm", "adds material")
    return max(mean, 0.0)
