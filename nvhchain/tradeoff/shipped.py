"""The sweep that comes with the package, from which tolerances are planned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from nvhchain.tradeoff.sweep import Tradeoff
from nvhchain.tradeoff.table import from_json

SHIPPED = Path(__file__).with_name("single-stage.json")
"""Every knob around `reference` on cases/small/single_stage.toml, written by benchmarks/tradeoff.py."""

EXTENT = {"width": [16 / 2.7], "overlap": [0.3275], "wave": 0.1116}
"""`extent` of that case, for what tables do not tell that were written before it was kept."""


def shipped_sweep() -> Tradeoff:
    """The measured table."""
    sweep = from_json(SHIPPED)
    told = sweep.provenance.get("extent", {})
    return replace(sweep, provenance={**sweep.provenance, "extent": None if told is None else {**EXTENT, **told}})
