"""Measure claims.json again: `python tests/tradeoff/regenerate_claims.py OUT`; say in the commit why it changed."""

import sys
from pathlib import Path

from turned_knobs import measured

from nvhchain.tradeoff import Measurement, Tradeoff, as_json

if __name__ == "__main__":
    base = Measurement("base", "tiny", {}, None)
    rows = [Measurement(knob, value, {}, error) for (knob, value), error in measured(Path(sys.argv[1])).items()]
    claims = Tradeoff("single-stage", "tiny", (base, *rows))  # times are no claims
    (Path(__file__).parent / "claims.json").write_text(as_json(claims), encoding="utf-8")
