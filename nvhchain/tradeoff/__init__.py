"""Measured trade-off of accuracy and time: every knob alone, the presets, and the cheapest sufficient settings."""

from nvhchain.tradeoff.deviation import Deviation, deviation, deviation_in_time
from nvhchain.tradeoff.files import save_tradeoff
from nvhchain.tradeoff.knobs import SWEPT_KNOBS, UNSWEPT, Knob, knobs_of, records, variants
from nvhchain.tradeoff.planner import cheapest
from nvhchain.tradeoff.shipped import shipped_sweep
from nvhchain.tradeoff.sweep import Measurement, Tradeoff, tradeoff
from nvhchain.tradeoff.table import as_json, comma_separated, from_json, markdown

__all__ = ["cheapest", "from_json"]
