"""Commented example cases for a first case of one's own."""

from __future__ import annotations

import re
import tomllib
from contextlib import ExitStack
from pathlib import Path

import nvhchain
from nvhchain.errors import InputError
from nvhchain.files.atomic_write import write_output

EXAMPLES = {
    "single-stage": ("small/single_stage.toml", "one helical pair in a small casting; seconds at `draft`"),
    "gearbox": ("gearbox/solid.toml", "two stages with solid gears in a casting"),
    "slotted": ("gearbox/slotted.toml", "the gearbox with slots in gear 2, as changes of a base file"),
    "run-up": ("gearbox/run_up_solid.toml", "the gearbox from low to high speed"),
    "rattle": ("small/rattle.toml", "a fluctuating drive that makes a loose gear rattle"),
    "bearings": ("small/catalogue_bearings.toml", "the helical pair on rolling bearings of the catalogue"),
    "cad": ("small/cad.toml", "the helical pair in a casting from a STEP file"),
    "radiator": ("sphere/on_floor.toml", "a small sphere above a floor: acoustics alone"),
}
"""Name of an example → (file, what it is)."""


TEMPLATES = ("single-stage", "rattle", "bearings", "cad")
"""Examples to change into a gearbox of one's own: their options decide themselves. Others keep their assumptions."""


COMMANDS = {
    "new": "nvhchain new single-stage mine",
    "import": "nvhchain import unit.rexs --out unit",
    "export": "nvhchain export mine/single_stage.toml --out unit.rexs",
    "run": "nvhchain run mine/single_stage.toml --fidelity draft --out out/mine",
    "record": 'nvhchain record mine/single_stage.toml --set "operation.ramp={end_speed_rpm=2000, duration=0.5}" '
    "--fidelity draft --out out/record",
    "compare": "nvhchain compare mine/single_stage.toml mine/wider.toml --fidelity draft --speeds 1200:2400:300",
    "plot": "nvhchain plot out/mine/pressure.h5 --out spectrum.png",
    "gear-field": "nvhchain gear-field mine/single_stage.toml --gear pinion --fidelity draft --out pinion.h5",
    "modes": "nvhchain modes mine/single_stage.toml --fidelity draft --out out/mine",
    "contributions": "nvhchain contributions mine/single_stage.toml --fidelity draft --out out/mine",
    "craig-bampton": "nvhchain craig-bampton mine/single_stage.toml --fidelity draft --modes-to 16000 --out case.bdf",
    "report": "nvhchain report out/mine",
    "sound": "nvhchain sound out/mine --without 20 40",
    "hearing": "nvhchain hearing out/mine",
    "microphones": "nvhchain microphones out/mine --iso3744",
    "tables": "nvhchain tables out/mine --out mine.xlsx",
    "tradeoff": "nvhchain tradeoff mine/single_stage.toml --fidelity draft --knob acoustics.radiation --out out/levels",
    "study": "nvhchain study blanks.toml --plan",
    "plan": "nvhchain plan mine/single_stage.toml --fidelity draft",
    "check": "nvhchain check mine/single_stage.toml --set operation.input_speed_rpm=1500",
    "schema": "nvhchain schema --out case.schema.json",
    "doctor": "nvhchain doctor",
    "completion": "nvhchain completion bash",
}
"""Command → a line to copy, which its help and the reference print and the tests run."""


def copy_example(name: str, folder: Path) -> list[Path]:
    """Copy an example and the files that it is based on, and write the schema to which they refer.

    Raises InputError if a file is there already.
    """
    from nvhchain.case.toml.schema import FILE_NAME, schema_text

    sources = [examples_folder() / EXAMPLES[name][0]]
    while base := tomllib.loads(sources[-1].read_text(encoding="utf-8")).get("base"):
        sources.append(sources[-1].parent / base)
    tables = [tomllib.loads(source.read_text(encoding="utf-8")) for source in sources]
    files = [sources[0].parent / table["housing"]["file"] for table in tables if "file" in table.get("housing", {})]
    targets = [folder / source.name for source in (*sources, *files)]
    for target in targets:
        if target.exists():
            raise InputError(f"{target} exists: name another folder, or remove it")
    contents = {target: source.read_bytes() for target, source in zip(targets[len(sources) :], files, strict=True)}
    for source, target in zip(sources, targets, strict=False):
        text = source.read_text(encoding="utf-8")
        text = _opened(text) if name in TEMPLATES else text
        contents[target] = f"#:schema ./{FILE_NAME}\n{text}".encode()
    folder.mkdir(parents=True, exist_ok=True)
    write_output(folder / FILE_NAME, schema_text().encode())
    with ExitStack() as undone:
        for target, content in contents.items():
            write_output(target, content)
            undone.callback(target.unlink)
        undone.pop_all()
    return targets


def _opened(text: str) -> str:
    """Return a case file whose options decide themselves."""
    block = re.compile(r"^\[options\].*?\n\n", re.MULTILINE | re.DOTALL)
    from nvhchain.case.options import DECIDABLE  # with numba, which the command line begins without

    values = "".join(f'{name} = "auto"\n' for name in DECIDABLE)
    title = "[options] # true or false, friction a number; `auto`: modelled where `plan` finds that it matters\n"
    return block.sub(f"{title}{values}\n", text)


def examples_folder() -> Path:
    """Return the folder of the examples: of an installed package, or of the repository."""
    package = Path(nvhchain.__file__).parent
    installed = package / "examples"
    return installed if installed.is_dir() else package.parent / "cases"
