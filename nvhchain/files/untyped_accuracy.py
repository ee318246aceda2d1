"""Accuracy of files of schema 1 and 2, which is taken from their provenance when they are read."""

from __future__ import annotations

from typing import Any

from nvhchain.handoff import Accuracy, HandOff

_MESHES = {
    "beyond_mesh_law": {
        "lowest": "lowest_deflection",
        "highest": "highest_deflection",
        "table_lowest": "table_lowest",
        "table_highest": "table_highest",
    },
    "parted_flanks": {"seconds": "parted_time"},
}
"""Entry by mesh → its numbers → their fields."""

_LABELS = {"beyond_mesh_law": "law_exceeded", "parted_flanks": "parted"}

_LINES = {
    "truncation_error_at_db": "truncation_frequency",
    "mapping_error_db": "mapping_frequency",
}
"""Entry by line, such as {"500 Hz": 0.1} → field of the lines."""


def typed(provenance: dict[str, Any], kind: type[HandOff]) -> tuple[dict[str, Any], dict[str, Accuracy]]:
    """Return the history without entries of accuracy, and the accuracy by the name of its field.

    Parameters
    ----------
    provenance : dict
        Provenance of a hand-off of schema 1 or 2.
    kind : type
        Class of the hand-off.

    Returns
    -------
    history : dict
        Rest of the provenance.
    accuracy : dict of str to Accuracy
        Empty for hand-offs without accuracy.

    Raises
    ------
    ValueError, TypeError, KeyError, AttributeError
        If an entry has another form.
    """
    if "accuracy" not in kind.declared:
        return provenance, {}
    of: type[Accuracy] = kind.declared["accuracy"].kind
    history, fields = dict[str, Any](), dict[str, Any]()
    for key, entry in provenance.items():
        if key in _MESHES and _LABELS[key] in of.declared:
            fields |= _mesh_table(key, entry)
        elif key in _LINES and key in of.declared:
            fields |= {_LINES[key]: [float(line.split()[0]) for line in entry], key: list(entry.values())}
        elif key.lower() in of.declared:
            fields[key.lower()] = entry
        else:
            history[key] = entry
    if fields.get("residual_mass") is not None:
        seats = len(fields["residual_mass"]) // 3
        fields["residual_mass"] = [
            [
                [row[3 * at : 3 * at + 3] for at in range(seats)]
                for row in fields["residual_mass"][3 * seat : 3 * seat + 3]
            ]
            for seat in range(seats)
        ]
    return history, {"accuracy": of(**fields)}


def _mesh_table(key: str, entry: dict[str, dict[str, float]]) -> dict[str, Any]:
    if not entry:
        return {}
    found: dict[str, Any] = {_LABELS[key]: tuple(entry)}
    for number, field in _MESHES[key].items():
        found[field] = [of[number] for of in entry.values()]
    if key == "parted_flanks":
        found["time_step"] = next(iter(entry.values()))["time_step"]
    return found
