"""Parts of a document by their relations: what stands on which shaft, and what the chain cannot model."""

from __future__ import annotations

from dataclasses import dataclass

from nvhchain.interop.rexs.contents.document import Component, Document
from nvhchain.interop.rexs.contents.findings import Findings
from nvhchain.interop.rexs.contents.values import Values
from nvhchain.names import safe_names

REFUSED = {
    "bevel_stage": "bevel gears",
    "bevel_gear": "bevel gears",
    "worm_stage": "worm gears",
    "worm_gear": "worm gears",
    "worm_wheel": "worm gears",
    "planetary_stage": "planetary stages",
    "planet_carrier": "planetary stages",
    "ring_gear": "internal gears",
    "differential": "differentials",
    "hypoid_stage": "hypoid gears",
    "hypoid_gear": "hypoid gears",
    "crossed_helical_stage": "crossed helical gears",
}
"""Component → its kind, which the chain does not model."""

READ = frozenset(
    [
        "gear_unit",
        "gear_casing",
        "shaft",
        "shaft_section",
        "cylindrical_stage",
        "cylindrical_gear",
        "cylindrical_stage_gear_data",
        "cylindrical_gear_flank",
        "cylindrical_gear_manufacturing_settings",
        "rack_shaped_tool",
        "concept_bearing",
        "rolling_bearing_with_catalog_geometry",
        "rolling_bearing_with_detailed_geometry",
        "rolling_bearing_row",
        "rolling_element",
        "external_load",
        "additional_mass",
        "coupling",
        "switchable_coupling",
        "material",
        "lubricant",
        "tip_relief",
        "root_relief",
        "profile_crowning",
        "helix_crowning",
    ]
)
"""Components that are read; others are listed as excluded."""

BEARINGS = ("rolling_bearing_with_catalog_geometry", "rolling_bearing_with_detailed_geometry", "concept_bearing")
MODIFICATIONS = (
    "helix_slope",
    "profile_slope",
    "end_relief_datum_face",
    "end_relief_non_datum_face",
    "profile_twist",
    "topographical_modification",
    "triangular_tip_relief",
    "triangular_root_relief",
    "profile_deviation",
    "helix_deviation",
)
"""Modifications of flanks that are listed as excluded with their gear."""

TOOLS = ("rack_shaped_tool", "cutter_wheel_tool", "profile_tool")

_LONGEST_NAME = 28


@dataclass(frozen=True)
class Parts:
    """Components of a gear unit by what they stand on.

    document: contents of the file.
    findings: record.
    names: name of every shaft, gear, stage and bearing in the case, by component.
    rotor: shaft that a shaft turns with, itself or the first of those that are coupled to it.
    idle: gears on couplings that are not engaged.
    """

    document: Document
    findings: Findings
    names: dict[int, str]
    rotor: dict[int, int]
    idle: frozenset[int] = frozenset()

    def values(self, component: Component) -> Values:
        """Return the reader of a component's attributes."""
        return Values(component, self.findings)

    def shafts(self) -> list[int]:
        """Return the shafts, without those that are coupled to another."""
        return [shaft for shaft, main in sorted(self.rotor.items()) if shaft == main]

    def shaft_of(self, component: Component) -> int | None:
        """Return the shaft that carries a component, by assembly or a coupling; a mistake where there is none."""
        owner = self.document.owner(component.id, "shaft")
        if owner is not None:
            return owner.id
        for side in (r for r in self.document.relations if r.type == "side"):
            ends = [end for role, end in side.refs if role != "assembly"]
            shafts = [end for end in ends if end in self.rotor]
            coupling = side.end("assembly")
            kind = "" if coupling is None else self.document.components[coupling].type
            if component.id in ends and shafts and kind in ("coupling", "switchable_coupling"):
                return shafts[0]
        self.findings.refuse(f"{component.label}: stands on no shaft: add the relation `assembly` with a shaft")
        return None


def find_parts(document: Document, findings: Findings) -> Parts:
    """Return the parts of a document, with mistakes for what the chain cannot model."""
    kinds: dict[str, list[Component]] = {}
    for component in document.components.values():
        if component.type in REFUSED:
            kinds.setdefault(REFUSED[component.type], []).append(component)
    if kinds:
        found = [c for kind in kinds.values() for c in ([c for c in kind if c.type.endswith("stage")] or kind)]
        named = ", ".join(c.label for c in found[:4]) + (f" and {len(found) - 4} more" if len(found) > 4 else "")
        findings.refuse(
            f"{' and '.join(kinds)} are not modelled: {named}: leave {'it' if len(found) == 1 else 'them'} "
            "out with their shafts, and export the external cylindrical gears on parallel shafts"
        )
        return Parts(document, findings, {}, {})
    if not document.typed("cylindrical_stage"):
        findings.refuse("no cylindrical_stage is in the file: export a gear unit with a stage of cylindrical gears")
    others: dict[str, int] = {}
    for component in document.components.values():
        if component.type not in {*READ, *REFUSED, *MODIFICATIONS}:
            others[component.type] = others.get(component.type, 0) + 1
    for kind, count in sorted(others.items()):
        findings.add("excluded", kind, "component", f"{count} of them", "not used by the chain")
    return Parts(document, findings, _names(document), _rotors(document, findings), _idle_gears(document))


def _names(document: Document) -> dict[int, str]:
    """Return distinct short names of shafts, gears, stages and bearings."""
    found: dict[int, str] = {}
    for types, word in (
        (("shaft",), "shaft"),
        (("cylindrical_gear",), "gear"),
        (("cylindrical_stage",), "stage"),
        (BEARINGS, "bearing"),
    ):
        components = document.typed(*types)
        wanted = []
        for component in components:
            designation = component.attributes.get("catalogue_designation")
            if word == "bearing" and designation is not None and str(designation.value).strip():
                wanted.append(f"{designation.value} ({component.id})")
            elif component.name and len(component.name) <= _LONGEST_NAME:
                wanted.append(component.name)
            else:
                wanted.append(f"{word} {component.id}")
        for component, name in zip(components, safe_names(wanted), strict=True):
            found[component.id] = name
    return found


def _rotors(document: Document, findings: Findings) -> dict[int, int]:
    """Return the shaft that each shaft turns with, by rigid and engaged couplings."""
    rotor = {shaft.id: shaft.id for shaft in document.typed("shaft")}
    for coupling in document.typed("coupling", "switchable_coupling"):
        if not _engaged(document, coupling):
            findings.add("excluded", coupling.label, "coupling", "not engaged", "is_engaged")
            continue
        ends = [
            e for r in document.related("side", "assembly", coupling.id) for role, e in r.refs if role != "assembly"
        ]
        shafts = [end for end in ends if end in rotor]
        casing = [end for end in ends if document.components[end].type == "gear_casing"]
        if casing and shafts:
            findings.refuse(
                f"{coupling.label}: holds {document.components[shafts[0]].label} at the casing: leave it out, shafts "
                "of the chain turn"
            )
        if len(shafts) == 2:
            one, other = (rotor[end] for end in shafts)
            rotor = {shaft: min(one, other) if main in (one, other) else main for shaft, main in rotor.items()}
            findings.add(
                "assumed", coupling.label, "coupling", "rigid, one shaft", "stiffness of couplings is not used"
            )
    return rotor


def _engaged(document: Document, coupling: Component) -> bool:
    """Return False for a coupling that is not engaged in the gear of the unit (gear_shift_index)."""
    engaged = coupling.attributes.get("is_engaged")
    if engaged is None:
        return True
    states = engaged.value if isinstance(engaged.value, list) else [engaged.value]
    index = [
        unit.attributes["gear_shift_index"].value
        for unit in document.typed("gear_unit")
        if "gear_shift_index" in unit.attributes
    ]
    position = int(index[0]) - 1 if index and str(index[0]).strip().isdigit() else 0
    state = states[min(max(position, 0), len(states) - 1)] if states else True
    return str(state).lower() not in ("false", "0")


def _idle_gears(document: Document) -> frozenset[int]:
    """Return the gears on couplings that are not engaged."""
    open_ = [c.id for c in document.typed("coupling", "switchable_coupling") if not _engaged(document, c)]
    ends = [end for c in open_ for r in document.related("side", "assembly", c) for role, end in r.refs]
    return frozenset(end for end in ends if document.components[end].type == "cylindrical_gear")
