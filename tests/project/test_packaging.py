"""Files around the package: wheel, citation, container, continuous integration."""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

import nvhchain

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_a_second_wheel_has_nothing_of_the_first_and_leaves_no_folder(tmp_path):
    source = tmp_path / "source"
    shutil.copytree(ROOT / "nvhchain", source / "nvhchain", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "cases", source / "cases")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE", "MANIFEST.in"):
        shutil.copyfile(ROOT / name, source / name)
    gone = source / "nvhchain" / "gone.py"
    contents = []
    for text in ("x = 1\n", None):
        gone.write_text(text) if text else gone.unlink()
        wheel = [
            sys.executable,
            "-m",
            "pip",
            "wheel",
            ".",
            "-q",
            "--no-deps",
            "--no-build-isolation",
            "-w",
            str(tmp_path),
        ]
        subprocess.run(wheel, cwd=source, check=True, capture_output=True)
        assert not (source / "build").exists()
        contents.append(set(zipfile.ZipFile(next(tmp_path.glob("*.whl"))).namelist()))
    assert contents[0] - contents[1] == {"nvhchain/gone.py"}
    assert {"nvhchain/py.typed", "nvhchain/examples/gearbox/solid.toml"} <= contents[1]


def test_the_citation_names_the_version_of_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert citation["version"] == project["version"] == nvhchain.__version__
    assert citation["license"] == project["license"]
    assert {"cff-version", "message", "title", "authors"} <= set(citation)


def test_the_container_has_the_libraries_that_gmsh_needs_and_pinned_wheels():
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    needed = re.search(r'GMSH_PACKAGES="(.*)"', (ROOT / "scripts" / "prepare.sh").read_text(encoding="utf-8"))[1]
    assert needed in text
    assert all("-c /src/constraints.txt" in line for line in text.splitlines() if "pip install" in line)
    extras = re.search(r'"/src\[(.*)\]"', text)[1].split(",")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(extras) <= set(project["optional-dependencies"])


def test_continuous_integration_runs_the_script_of_the_repository():
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    assert any(step.get("run") == ".ci/run" for step in workflow["jobs"]["all"]["steps"])
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o100


def test_hooks_call_programs_of_the_test_environment():
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
    programs = {hook["entry"].split()[0] for hook in hooks}
    assert programs == {".venv/bin/ruff", ".venv/bin/mypy", ".venv/bin/nvhchain"}


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md", "CHANGELOG.md"])
def test_links_of_pages_lead_to_files(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    links = [link.partition("#")[0] for link in re.findall(r"\]\(([^)]+)\)", text) if not link.startswith("http")]
    assert [link for link in links if not (ROOT / link).exists()] == []
