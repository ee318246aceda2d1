"""Verdicts of the gallery: figures and tables of S. Shweiki's thesis, chapters 3 to 5, beside its stated numbers.

    python -m benchmarks gallery OUT

Makes the gallery in OUT at `standard`, or takes what is there, and writes docs/measured/gallery.md and the pictures in
docs/_static/gallery/, reduced in size. It goes on from there after an interruption. A row that fails leaves the others
alone; with such a row, or a number beyond the limits of its verdict, the command fails at the end.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

from PIL import Image

from benchmarks.publish import ROOT, publish
from nvhchain.cli.examples import examples_folder
from nvhchain.fidelity import STANDARD
from nvhchain.gallery.making import made_items
from nvhchain.gallery.page import chapters, write_pages
from nvhchain.gallery.registry import ITEMS

PICTURES = ROOT / "docs" / "_static" / "gallery"
WIDTH, COLOURS = 1000, 96
"""Width (pixels) and number of colours of the pictures in the documentation."""


def reduce_picture(source: Path, target: Path) -> None:
    """Write a picture of at most `WIDTH` pixels in `COLOURS` colours."""
    with Image.open(source) as opened:
        picture = opened.convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    reduced = picture.quantize(COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    target.parent.mkdir(parents=True, exist_ok=True)
    reduced.save(target, optimize=True)


def main() -> None:
    out = Path(sys.argv[1])
    made = made_items(
        ITEMS, out, fidelity=STANDARD, cases=examples_folder() / "gearbox", progress=partial(print, flush=True)
    )
    write_pages(made, out)
    count = sum(bool(each.numbers) for each in made)
    clock, used = sum(each.seconds for each in made) / 60.0, sum(each.processor_seconds for each in made) / 60.0
    head = f"{count} of {len(made)} items are made at `standard`, in {used:.0f} minutes of processor time"
    if used < 0.8 * clock:
        head += f" and {clock:.0f} minutes by the clock, since other work left {used / clock:.0%} of a processor"
    head += ". Runs of the gearbox and operators that are found count as nothing.\n\n"
    for each in made:
        if each.picture:
            reduce_picture(out / each.picture, PICTURES / each.picture)
    publish("gallery", head + chapters(made, "../_static/gallery/"))
    for each in made:
        if each.failure or each.missed:
            print(f"{each.item.number}: {each.failure or 'beyond its limits: ' + ', '.join(each.missed)}")
    sys.exit(any(each.failure or each.missed for each in made))


if __name__ == "__main__":
    main()
