"""The documentation builds without a warning and its generated tables hold what the code holds."""

import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

import nvhchain
from nvhchain.fidelity import PRESETS

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Text of every page, from the command that `make docs` runs."""
    folder = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "text", "docs", str(folder)]
    done = subprocess.run([*command, "-d", str(folder / ".doctrees")], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {path.relative_to(folder).with_suffix("").as_posix(): path.read_text() for path in folder.rglob("*.txt")}


def test_every_fidelity_knob_is_listed_with_its_three_values(pages):
    cells = [[cell.strip() for cell in line.split("|")[1:5]] for line in pages["fidelity"].splitlines() if "|" in line]
    rows = {row[0].strip('"'): row[1:] for row in cells if row}
    stages = [getattr(PRESETS["draft"], field.name) for field in fields(PRESETS["draft"]) if field.name != "name"]
    assert {knob.name for stage in stages for knob in fields(stage)} <= set(rows)
    assert rows["masters"] == [str(preset.acoustics.masters) for preset in PRESETS.values()]


def test_every_name_scripts_rely_on_is_documented(pages):
    names = set(re.findall(r"nvhchain\.[\w.]+", pages["api"]))
    wanted = {
        "handoff.forces.BearingForces",
        "conventions.Air",
        "acoustics.transfer.transfer_vectors",
        "chain.run",
        "case.load.load_case",
    }
    assert {f"nvhchain.{name}" for name in wanted} <= names


def test_the_script_in_the_readme_uses_names_that_exist():
    readme = (ROOT / "README.md").read_text()
    (script,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    compile(script, "README.md", "exec")
    for name in re.findall(r"\bnvh\.(\w+)", script):
        assert hasattr(nvhchain, name)
    for module, imported in re.findall(r"^from (nvhchain[\w.]*) import (.+)$", script, re.MULTILINE):
        exec(f"from {module} import {imported}", {})
    for field in re.findall(r"\bresult\.(\w+)", script):
        assert field in {f.name for f in fields(nvhchain.run.__globals__["Result"])}


def test_every_file_the_readme_points_to_exists():
    readme = (ROOT / "README.md").read_text()
    targets = [t for t in re.findall(r"\]\(([^)#]+)\)", readme) if "://" not in t]
    assert targets
    assert not [target for target in targets if not (ROOT / target).exists()]
