"""Pictures of a case: its gears and their meshes, the gearbox in its housing, displacement and stress of one gear."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes

from nvhchain import gear, plots
from nvhchain.case import GearboxCase, load_case
from nvhchain.errors import InputError, require
from nvhchain.fidelity import Fidelity
from nvhchain.handoff import GearField
from nvhchain.plots.files import check_format, save


def draw_case(
    path: Path,
    picture: Path,
    fidelity: Fidelity,
    *,
    stage: str | None = None,
    gear_name: str | None = None,
    angle: float = 0.0,
) -> None:
    """Draw a gearbox in its housing, one stage, or one gear of a case as PNG, SVG or PDF.

    stage: stage: both gears in mesh, with their elements and the teeth in contact.
    gear_name: gear: its elements, and the teeth in contact in its stages.
    angle: angle of the wheel of a stage (rad).
    """
    check_format(picture)
    case = _gearbox(path)
    require(stage is None or gear_name is None, f"stage {stage} and gear {gear_name}: draw one of them")
    save(_drawn(case, fidelity, stage, gear_name, angle), picture)


def loaded_gear(
    case: GearboxCase, fidelity: Fidelity, gear_name: str, *, stage: str | None = None, angle: float = 0.0
) -> GearField:
    """Compute displacement and stress of a gear of a case under the torque of its operation.

    fidelity: finite elements and slices of the contact.
    stage: stage that loads it; needed for a gear in several.
    angle: angle of the wheel of the stage (rad).
    """
    number = _stage_of(case, gear_name, stage)
    pair, force, gear_stage = case.pairs[number], case.mesh_forces[number], case.stages[number]
    require(
        force > 0,
        f"stage {gear_stage.name}: mesh force = {force:g} N: displacement and stress need a driving torque, "
        "input_torque > 0",
    )
    engagement = gear.Engagement(pair, gear.pair_compliances(pair, fidelity.gear), fidelity.gear)
    loaded = gear.loaded_mesh(engagement, angle, force, guess=1e-9 * force)
    closing = gear.close_edges(engagement, loaded.deflection)
    if closing is not engagement:
        loaded = gear.loaded_mesh(closing, angle, force, guess=loaded.deflection)
    end = gear.PINION if gear_stage.pinion == gear_name else gear.WHEEL
    return gear.gear_field(pair, end, loaded, fidelity.gear)


def _drawn(case: GearboxCase, fidelity: Fidelity, stage: str | None, gear_name: str | None, angle: float) -> list[Axes]:
    """Return the figure of a stage, a gear or the whole gearbox."""
    names = [item.name for item in case.stages]
    if stage is not None:
        require(stage in names, f"{case.name} has no stage {stage!r}: known: {', '.join(names)}")
        gear_stage = case.stages[names.index(stage)]
        pair = case.pairs[names.index(stage)]
        return plots.gear_pair(pair, fidelity.gear, angle=angle, names=(gear_stage.pinion, gear_stage.wheel))
    if gear_name is not None:
        found = next((item for item in case.gears if item.name == gear_name), None)
        if found is None:
            raise InputError(f"{case.name} has no gear {gear_name!r}: known: {', '.join(g.name for g in case.gears)}")
        teeth = set()
        for gear_stage, pair in zip(case.stages, case.pairs, strict=True):
            for end, name in enumerate((gear_stage.pinion, gear_stage.wheel)):
                if name == gear_name:
                    touching = gear.contact_lines(pair, angle, slices=1).tooth[end]
                    teeth |= {int(tooth) % found.geometry.teeth for tooth in touching}
        return plots.gear_mesh(found.body, fidelity.gear, teeth=teeth, name=gear_name)
    require(angle == 0.0, "the gearbox is drawn at wheel angle 0: name a stage or a gear for another")
    return plots.gearbox(case, case.housing.shape(case, fidelity.housing), fidelity.gear)


def _stage_of(case: GearboxCase, gear_name: str, stage: str | None) -> int:
    """Return the index of the stage of a gear."""
    found = [
        i
        for i, gear_stage in enumerate(case.stages)
        if gear_name in (gear_stage.pinion, gear_stage.wheel) and (stage is None or gear_stage.name == stage)
    ]
    if not found:
        known = ", ".join(f"{gear_stage.name} ({gear_stage.pinion}, {gear_stage.wheel})" for gear_stage in case.stages)
        where = "" if stage is None else f" in stage {stage!r}"
        raise InputError(f"{case.name} has no gear {gear_name!r}{where}: known: {known}")
    require(
        len(found) == 1,
        f"gear {gear_name} is in stages {', '.join(case.stages[i].name for i in found)}: name the stage",
    )
    return found[0]


def _gearbox(path: Path) -> GearboxCase:
    """Read a case that has gears."""
    case = load_case(path)
    if not isinstance(case, GearboxCase):
        raise InputError(f"{path}: {case.name} is a radiator: it has no gears to draw")
    return case
