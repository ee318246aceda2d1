"""REXS, the exchange format of gear units: reader of parallel-shaft units."""

from nvhchain.interop.rexs.contents.findings import Finding, Findings
from nvhchain.interop.rexs.read import read_rexs
from nvhchain.interop.rexs.unit import (
    FlankShape,
    GearUnit,
    ImportedBearing,
    ImportedGear,
    ImportedLoad,
    ImportedRelief,
    ImportedShaft,
    ImportedStage,
    Section,
)

__all__ = [
    "Finding",
    "Findings",
    "FlankShape",
    "GearUnit",
    "ImportedBearing",
    "ImportedGear",
    "ImportedLoad",
    "ImportedRelief",
    "ImportedShaft",
    "ImportedStage",
    "Section",
    "read_rexs",
]
