"""Boundary dimensions of rolling bearings by their designation: ISO 15, ISO 355 for tapered ones, ISO 1206 for needles.

All 65 sizes of series 10, 02, 03 and 22 that the open parts library BOLTS has (DIN 625-1, 625-3, 5412-1) are the same.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from functools import cache

# fmt: off
_TABLE = """
bore  D8  18  D9  19 49  D0 10 30 320 330  D2 02 22   32   302   322  D3 03  23   33   303   323
  10  19   5  22   6 13  26  8  -   -   -  30  9 14 14.3     -     -  35 11  17    -     -     -
  12  21   5  24   6 13  28  8  -   -   -  32 10 14 15.9     -     -  37 12  17    -     -     -
  15  24   5  28   7 13  32  9  -   -   -  35 11 14 15.9     -     -  42 13  17 19.0 14.25     -
  17  26   5  30   7 13  35 10  -   -   -  40 12 16 17.5 13.25     -  47 14  19 22.2 15.25 20.25
  20  32   7  37   9 17  42 12  -  15   -  47 14 18 20.6 15.25     -  52 15  21 22.2 16.25 22.25
  25  37   7  42   9 17  47 12 16  15  17  52 15 18 20.6 16.25     -  62 17  24 25.4 18.25 25.25
  30  42   7  47   9 17  55 13 19  17  20  62 16 20 23.8 17.25 21.25  72 19  27 30.2 20.75 28.75
  35  47   7  55  10 20  62 14 20  18  21  72 17 23 27.0 18.25 24.25  80 21  31 34.9 22.75 32.75
  40  52   7  62  12 22  68 15 21  19  22  80 18 23 30.2 19.75 24.75  90 23  33 36.5 25.25 35.25
  45  58   7  68  12 22  75 16 23  20  24  85 19 23 30.2 20.75 24.75 100 25  36 39.7 27.25 38.25
  50  65   7  72  12 22  80 16 23  20  24  90 20 23 30.2 21.75 24.75 110 27  40 44.4 29.25 42.25
  55  72   9  80  13 25  90 18 26  23  27 100 21 25 33.3 22.75 26.75 120 29  43 49.2  31.5  45.5
  60  78  10  85  13 25  95 18 26  23  27 110 22 28 36.5 23.75 29.75 130 31  46 54.0  33.5  48.5
  65  85  10  90  13 25 100 18 26  23  27 120 23 31 38.1 24.75 32.75 140 33  48 58.7    36    51
  70  90  10 100  16 30 110 20 30  25  31 125 24 31 39.7 26.25 33.25 150 35  51 63.5    38    54
  75  95  10 105  16 30 115 20 30  25  31 130 25 31 41.3 27.25 33.25 160 37  55    -    40    58
  80 100  10 110  16 30 125 22 34  29  36 140 26 33 44.4 28.25 35.25 170 39  58    -  42.5  61.5
  85 110  13 120  18 35 130 22 34  29  36 150 28 36 49.2  30.5  38.5 180 41  60    -     -     -
  90 115  13 125  18 35 140 24 37  32  39 160 30 40 52.4  32.5  42.5 190 43  64    -     -     -
  95 120  13 130  18 35 145 24 37  32  39 170 32 43 55.6  34.5  45.5 200 45  67    -     -     -
 100 125  13 140  20 40 150 24 37  32  39 180 34 46 60.3    37    49 215 47  73    -     -     -
 105 130  13 145  20  - 160 26 41  35   - 190 36 50    -     -     - 225 49  77    -     -     -
 110 140  16 150  20 40 170 28 45  38   - 200 38 53    -     -     - 240 50  80    -     -     -
 120 150  16 165  22 45 180 28 46  38   - 215 40 58    -     -     - 260 55  86    -     -     -
 130 165  18 180  24 50 200 33 52  45   - 230 40 64    -     -     - 280 58  93    -     -     -
 140 175  18 190  24 50 210 33 53  45   - 250 42 68    -     -     - 300 62 102    -     -     -
 150 190  20 210  28 60 225 35 56  48   - 270 45 73    -     -     - 320 65 108    -     -     -
"""
# fmt: on
"""Outer diameters by diameter series, widths by dimension series, T of tapered bearings by type and series (mm)."""

_SERIES = {
    "1": {"2": "02", "3": "03"},
    "2": {"2": "22", "3": "23", "13": "03", "22": "22", "23": "23", "30": "30"},
    "3": {"2": "32", "3": "33", "02": "302", "03": "303", "20": "320", "22": "322", "23": "323", "30": "330"},
    "4": {"2": "22", "3": "23"},
    "6": {"0": "10", "2": "02", "3": "03", "18": "18", "19": "19", "22": "22", "23": "23", "30": "30"},
    "7": {"0": "10", "2": "02", "3": "03", "18": "18", "19": "19"},
    "N": {"2": "02", "3": "03", "10": "10", "22": "22", "23": "23", "30": "30", "49": "49"},
}
"""Dimension series by type and series of a designation; rollers and four-point bearings as N."""

_ROLLERS = frozenset(["N", "NU", "NJ", "NUP", "NF", "NH", "NN", "NNU", "NCF", "NA", "RN", "RNU", "RNA", "QJ"])
"""Letters before the series of roller bearings and of four-point bearings; others name a maker or a material."""

Sizes = tuple[float, float, float | None]


@cache
def _table() -> dict[float, dict[str, float]]:
    """Return the sizes (mm) in a row of the table by bore (mm)."""
    head, *rows = (line.split() for line in _TABLE.split("\n") if line.strip())
    read = ({name: float(x) for name, x in zip(head, row, strict=True) if x != "-"} for row in rows)
    return {row["bore"]: row for row in read}


def named_sizes(designation: str) -> Sizes | None:
    """Return bore, outer diameter and perhaps width (m) of a designation such as 6210, 33014, NU 210 or 50x58x25."""
    sizes = re.search(r"(\d+)\s*[xX×]\s*(\d+)\s*[xX×]\s*(\d+)", designation)
    if sizes:
        bore, outer, width = (1e-3 * float(size) for size in sizes.groups())
        return (bore, outer, width) if bore < outer else None
    found = re.search(r"\b([A-Z]*)[\s-]?(\d{3,5})(?!\d)", designation.upper())
    if found is None:
        return None
    letters, digits = found.groups()
    code = int(digits[-2:])
    row = _table().get({0: 10, 1: 12, 2: 15, 3: 17}.get(code, 5 * code))
    rollers = letters in _ROLLERS
    series = digits[:-2] if rollers else digits[1:-2]
    known = _SERIES["N"] if rollers else _SERIES.get(digits[0], {})
    if row is None or f"D{series[-1:]}" not in row:
        return None
    wide = row.get(known.get(series, ""))
    return 1e-3 * row["bore"], 1e-3 * row[f"D{series[-1:]}"], None if wide is None else 1e-3 * wide


def light_sizes(bore: float) -> Sizes:
    """Return bore, outer diameter and width (m) of a bearing of dimension series 02 on a shaft (m).

    Outer diameter and width of the next bore of ISO 15, in proportion.
    """
    bores = sorted(_table())
    row = _table()[bores[min(bisect_left(bores, 1e3 * bore - 0.01), len(bores) - 1)]]
    return bore, bore * row["D2"] / row["bore"], bore * row["02"] / row["bore"]
