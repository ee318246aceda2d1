"""Pages of a gallery: pictures, our numbers beside the thesis's, verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

from nvhchain.files.hdf5 import write_text
from nvhchain.gallery.making import Made

TITLE = "Figures and tables of S. Shweiki's thesis, chapters 3 to 5"

_HEAD = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222 }}
table {{ border-collapse: collapse }} th, td {{ padding: .1rem .8rem; border-bottom: 1px solid #ddd; text-align: left }}
td + td {{ text-align: right }} img {{ max-width: 100% }}
</style></head><body>
<h1>{title}</h1>
"""


def write_pages(made: Sequence[Made], out: Path) -> tuple[Path, Path]:
    """Write index.md and index.html."""
    write_text(out / "index.md", _markdown(made))
    write_text(out / "index.html", _html(made))
    return out / "index.md", out / "index.html"


def chapters(made: Sequence[Made], pictures: str = "") -> str:
    """Return all items by chapter (Markdown), each with its verdict, numbers, command and picture.

    pictures: folder of the pictures, with a slash at its end.
    """
    lines, chapter = [], ""
    for each in made:
        digits = [letter for letter in each.item.number if letter.isdigit()]
        if digits[0] != chapter:
            chapter = digits[0]
            lines += [f"## Chapter {chapter}", ""]
        lines += [f"### {each.item.number}: {each.item.title}", "", *_body(each, pictures)]
        lines += [f'`python -m nvhchain.gallery "{each.item.number}" --out DIR`', ""]
    return "\n".join(lines)


def _verdict(made: Made) -> str:
    """Return the verdict with the reading; numbers beyond its limits are named."""
    if made.failure:
        return f"Failed: {' '.join(str(made.failure).split()) or type(made.failure).__name__}"
    if made.pending:
        return f'Not made yet: `python -m nvhchain.gallery "{made.item.number}"`.'
    missed = f" Outside the limits of this verdict: {', '.join(made.missed)}." if made.missed else ""
    reading = f" Reading: {made.item.reading}" if made.item.reading else ""
    return made.item.verdict + missed + reading


def _rows(made: Made) -> list[tuple[str, str, str, str]]:
    """Return quantity, the thesis's number, ours and the deviation of each number."""
    rows = []
    for name, ours in made.numbers.items():
        stated = made.item.stated.get(name)
        if name.endswith("/ yes"):
            words = ("no", "yes")
            theirs = "" if stated is None else words[int(stated.value)]
            rows.append((name.removesuffix(" / yes"), theirs, words[int(ours)], ""))
            continue
        theirs = "" if stated is None else f"{'≤ ' if stated.bound else ''}{stated.value:.4g}"
        compared = stated is not None and stated.value and not stated.bound
        off = f"{round(100 * (ours / stated.value - 1), 1) + 0.0:+.1f} %" if stated is not None and compared else ""
        shown = "0" if stated is not None and not stated.value and stated.holds(ours) else f"{ours:.4g}"
        rows.append((name, theirs, shown, off))
    return rows


def _markdown(made: Sequence[Made]) -> str:
    lines = [f"# {TITLE}", ""]
    for each in made:
        lines += [f"## {each.item.number}: {each.item.title}", "", *_body(each)]
    return "\n".join(lines)


def _body(made: Made, pictures: str = "") -> list[str]:
    """Return verdict, numbers and picture of an item (lines of Markdown)."""
    lines = [_verdict(made), ""]
    if made.numbers:
        lines += ["| quantity | thesis | ours | deviation |", "|---|---:|---:|---:|"]
        lines += [f"| {' | '.join(row)} |" for row in _rows(made)] + [""]
    if made.picture:
        lines += [f"![{made.item.title}]({pictures}{made.picture})", ""]
    return lines


def _html(made: Sequence[Made]) -> str:
    parts = [_HEAD.format(title=escape(TITLE))]
    for each in made:
        parts.append(
            f"<h2>{escape(each.item.number)}: {escape(each.item.title)}</h2>\n<p>{escape(_verdict(each))}</p>\n"
        )
        if each.numbers:
            head = "".join(f"<th>{name}</th>" for name in ("quantity", "thesis", "ours", "deviation"))
            rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>\n" for row in _rows(each))
            parts.append(f"<table><tr>{head}</tr>\n{rows}</table>\n")
        if each.picture:
            parts.append(f'<p><img src="{each.picture}" alt="{escape(each.item.title)}"></p>\n')
    return "".join(parts) + "</body></html>\n"
