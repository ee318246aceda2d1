"""Fidelity, seconds and provenance of every hand-off."""

from __future__ import annotations

import json
from os.path import relpath
from typing import Any

from nvhchain.files import hdf5
from nvhchain.report.page.blocks import Table, Text
from nvhchain.report.stored import Stored

TITLE = "How it was made"


def blocks(stored: Stored) -> list[Any]:
    """Return the fidelity, and step, file, seconds and version of every hand-off with its knobs."""
    rows: list[tuple[str, ...]] = []
    knobs: dict[str, list[str]] = {}
    for path in stored.hand_off_files:
        kind, provenance = hdf5.record(path)
        seconds = provenance.get("seconds")
        size = path.stat().st_size / 1e6
        rows.append(
            (
                kind,
                relpath(path, stored.folder),
                str(provenance.get("version", "")),
                f"{seconds:.1f}" if isinstance(seconds, int | float) else "",
                f"{size:.1f}",
            )
        )
        if provenance.get("fidelity"):
            step = str(provenance.get("stage", kind)).split("_stage")[0]
            text = json.dumps(provenance["fidelity"], indent=1, ensure_ascii=False)
            if text not in knobs.setdefault(step, []):  # slow speeds have other knobs
                knobs[step].append(text)
    names = dict.fromkeys(
        str(fidelity)
        for fidelity in (stored.summary.get("fidelity"), *(run.case.get("fidelity") for run in stored.runs))
        if fidelity
    )
    found: list[Any] = [Text(f"Fidelity: {', '.join(names)}.")] if names else []
    if rows:
        total = sum(float(row[3] or 0.0) for row in rows)
        caption = "Stored results of the steps, and the seconds they took" + (
            f" ({total:.0f} s in all)." if total else "."
        )
        found.append(Table(("hand-off", "file", "version", "seconds", "MB"), rows, caption, numbers=3))
    if knobs:
        cells = [(step, text) for step, texts in knobs.items() for text in texts]
        found.append(Table(("step", "knobs"), cells, "Knobs of every step", folded=True, numbers=9))
    return found
