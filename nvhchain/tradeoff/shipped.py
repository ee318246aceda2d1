"""Shipped sweep, from which tolerances are planned."""

from __future__ import annotations

from pathlib import Path

from nvhchain.tradeoff.sweep import Tradeoff
from nvhchain.tradeoff.table import from_json

SHIPPED = Path(__file__).with_name("single-stage.json")
"""Sweep of every knob around `reference` on cases/small/single_stage.toml, by benchmarks/chain/tradeoff.py."""


def shipped_sweep() -> Tradeoff:
    """Read the sweep that comes with the package."""
    return from_json(SHIPPED)
