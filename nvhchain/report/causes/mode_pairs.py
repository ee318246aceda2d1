"""Names of the modes of two housings, in which one mode of both has one name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from nvhchain.chain.result import Result
from nvhchain.handoff import ReducedHousing
from nvhchain.housing.casting.contributions import Contributions, mode_names
from nvhchain.housing.modes.modal_assurance import paired_modes


def joint_names(first: Result, second: Result) -> tuple[dict[str, str], dict[str, str]] | None:
    """Return, for either design, names of its modes → names in a comparison; None where no mode has a partner.

    A pair is named after the first, with its frequency in the second. A mode of one design alone names the other, which
    has no partner of it. One housing of both keeps its names.
    """
    if first.housing is None or second.housing is None or first.housing.content_hash == second.housing.content_hash:
        return {}, {}
    before, after = mode_names(first.housing), mode_names(second.housing)
    pairs = paired_modes(first.housing, second.housing)
    if not pairs:
        return None
    designs = first.case.name, second.case.name
    names = (
        {name: f"{name} (no partner in {designs[1]})" for name in before},
        {name: f"{name} (no partner in {designs[0]})" for name in after},
    )
    for one, other in pairs:
        mine, frequency = before[one], after[other].partition(", ")[2]
        joint = mine if mine.endswith(f", {frequency}") else f"{mine} ({frequency} in {designs[1]})"
        names[0][before[one]] = names[1][after[other]] = joint
    return names[0], names[1]


def first_names(first: ReducedHousing, other: ReducedHousing, design: str) -> dict[str, str]:
    """Return names of the modes of another housing → names beside the first: of its partner there, or its own."""
    if first.content_hash == other.content_hash:
        return {}
    before, after = mode_names(first), mode_names(other)
    found = {name: f"{name} ({design})" for name in after}
    return found | {after[column]: before[row] for row, column in paired_modes(first, other)}


def renamed(parts: Contributions, names: Mapping[str, str]) -> Contributions:
    """Return parts with other names."""
    return replace(parts, names=tuple(names.get(name, name) for name in parts.names))
