"""HTML page of a comparison: verdict, levels, figures, sound, and the fidelity of every hand-off."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable
from html import escape as as_html
from pathlib import Path
from string import Template
from typing import Any
from urllib.parse import quote

from nvhchain.error_band import format_limits
from nvhchain.errors import InputError, require
from nvhchain.files import hdf5
from nvhchain.files.hdf5 import write_text
from nvhchain.names import check_names, printable
from nvhchain.report.verdict import verdict

CAPTIONS = {
    "pressure_spectrum": "Sound pressure level at the field point, plain and A-weighted.",
    "pressure_history": "Sound pressure over time.",
    "bearing_forces": "Bearing forces on the housing.",
    "transmission_errors": "Quasi-static transmission error of every stage.",
    "surface_velocity": "Normal velocity of the housing at its strongest line.",
    "waterfall": "Sound pressure over speed and frequency.",
    "orders": "Sound pressure over speed and order of the input.",
    "levels": "Levels over speed.",
}
"""Captions of the figures in their order on the page; `surface_velocity-NAME` belongs to configuration NAME."""

PAGE = Template("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse } th, td { padding: .2rem .8rem; border-bottom: 1px solid #ddd; text-align: left }
figure { margin: 2rem 0 } img { max-width: 100% } figcaption { color: #555 } pre { overflow-x: auto }
</style></head><body>
<h1>$title</h1>
$verdict
<p>Fidelity <code>$fidelity</code>, field point $point.</p>
$levels
$differences
$figures
<h2>How it was made</h2>
$making
</body></html>
""")


def write_page(folder: str | Path) -> Path:
    """Write `report.html`, with its figures inside, to the folder of a comparison.

    Parameters
    ----------
    folder : str or Path
        Folder that `compare` filled.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    InputError
        If the folder holds no readable comparison.
    """
    folder = Path(folder)
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}/summary.json cannot be read ({error}): run `nvhchain compare` first") from None
    try:
        page = _page(folder, summary)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{folder}/summary.json is not what `nvhchain compare` leaves ({error!r:.100}): run it again"
        ) from None
    write_text(folder / "report.html", page)
    return folder / "report.html"


def _page(folder: Path, summary: dict[str, Any]) -> str:
    names = list(summary["configurations"])
    require(len(names) > 0, f"{folder}/summary.json holds no configuration: run `nvhchain compare` again")
    check_names(names, f"{folder}/summary.json: configurations")
    point = summary["field_point"]
    return PAGE.substitute(
        title=escape(" and ".join(names)),
        fidelity=escape(summary["fidelity"]),
        point=escape(f"{point['name']} at {point['position_m']} m"),
        verdict=_verdict(summary),
        levels=_table(
            ("configuration", "level / dB(A)", "limits / dB(A)", "sound"),
            (
                (escape(name), f"{configuration['overall_dBA']:.1f}", _limits(configuration), _sound(folder, name))
                for name, configuration in summary["configurations"].items()
            ),
        ),
        differences=_differences(folder),
        figures="\n".join(_figures(folder, names)),
        making=_table(("hand-off", "file", "version", "fidelity"), _hand_off_rows(folder)),
    )


def escape(text: object) -> str:
    """Return text for a page, without markup or control characters."""
    return as_html(printable(str(text)))


def _verdict(summary: dict[str, Any]) -> str:
    """Return the sentences of the verdict; indented ones are the items of a list."""
    parts = []
    for sentence in verdict(summary):
        text = escape(sentence.strip())
        parts.append(f"<ul><li>{text}</li></ul>" if sentence.startswith(" ") else f"<p>{text}</p>")
    return "\n".join(parts).replace("</ul>\n<ul>", "\n")


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return an HTML table; the cells are HTML."""
    lines = ["<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows]
    return f"<table><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr>{''.join(lines)}</table>"


def _limits(configuration: dict[str, Any]) -> str:
    """Confidence limits of a configuration; empty for summaries of older versions, which have none."""
    limits = configuration.get("error_band_dBA")
    return format_limits(limits) if limits else ""


def _sound(folder: Path, name: str) -> str:
    file = f"sound-{name}.wav"
    return f'<audio controls src="{escape(quote(file))}"></audio>' if (folder / file).exists() else ""


def _differences(folder: Path) -> str:
    path = folder / "differences.txt"
    if not path.exists():
        return ""
    return f"<h2>Strongest orders</h2><pre>{escape(path.read_text(encoding='utf-8'))}</pre>"


def _figures(folder: Path, names: list[str]) -> Iterable[str]:
    for stem, caption in CAPTIONS.items():
        for file, of in [(stem, ""), *((f"{stem}-{name}", f" ({name})") for name in names)]:
            path = folder / f"{file}.png"
            if path.exists():
                image = base64.b64encode(path.read_bytes()).decode("ascii")
                text = escape(caption.removesuffix(".") + of + ".")
                yield (
                    f'<figure><img alt="{text}" src="data:image/png;base64,{image}">'
                    f"<figcaption>{text}</figcaption></figure>"
                )


def _hand_off_rows(folder: Path) -> Iterable[tuple[str, ...]]:
    for path in sorted(folder.rglob("*.h5")):
        kind, provenance = hdf5.record(path)
        knobs = provenance.get("fidelity")
        detail = f"<pre>{escape(json.dumps(knobs, indent=1))}</pre>" if knobs else ""
        yield (
            escape(kind),
            escape(path.relative_to(folder)),
            escape(provenance.get("version", "")),
            f"<details><summary>values</summary>{detail}</details>" if detail else "",
        )
