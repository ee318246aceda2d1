"""The documentation builds without a warning and its generated tables hold what the code holds."""

import ast
import importlib
import pkgutil
import re
import shlex
import subprocess
import sys
import tomllib
from dataclasses import fields, is_dataclass
from functools import cached_property
from pathlib import Path

import pytest

import nvhchain
from nvhchain.case.gearbox import GearboxCase
from nvhchain.case.radiator import RadiatorCase
from nvhchain.case.toml.meanings import fields_in_files, meanings
from nvhchain.chain import Result
from nvhchain.cli import main, parser
from nvhchain.fidelity import PRESETS

pytestmark = pytest.mark.usefixtures("common_operators")

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Text of every page, from the command that `make docs` runs."""
    folder = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "text", "docs", str(folder)]
    done = subprocess.run([*command, "-d", str(folder / ".doctrees")], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {path.relative_to(folder).with_suffix("").as_posix(): path.read_text() for path in folder.rglob("*.txt")}


def rows_of(page):
    """First lines of the rows of all tables: their first four cells."""
    return [[cell.strip() for cell in line.split("|")[1:5]] for line in page.splitlines() if "|" in line]


@pytest.mark.slow
def test_every_fidelity_knob_is_listed_with_its_three_values(pages):
    rows = {row[0].strip('"'): row[1:] for row in rows_of(pages["reference/fidelity"])}
    draft = PRESETS["draft"]
    stages = [part for field in fields(draft) if is_dataclass(part := getattr(draft, field.name))]
    assert len(stages) == 4
    assert {knob.name for stage in stages for knob in fields(stage)} <= set(rows)
    assert rows["masters"] == [str(preset.acoustics.masters) for preset in PRESETS.values()]


@pytest.mark.slow
def test_every_field_of_a_case_is_listed_with_its_meaning(pages):
    rows = [
        row
        for row in rows_of(pages["reference/cases"].split("\nFields\n")[-1])
        if len(row) > 3 and re.match(r'"[a-z]', row[0])
    ]
    assert len(rows) > 150
    # a meaning that several fields share stands once, at the first of them
    shared = [name for name, meaning in ((row[0], row[3]) for row in rows) if not meaning]
    assert len(shared) < 60
    assert rows[0][3]
    for cls in (GearboxCase, RadiatorCase):
        said = meanings(cls)
        assert [field.name for field, _ in fields_in_files(cls) if not said.get(field.name)] == []


@pytest.mark.slow
def test_every_name_that_a_package_offers_is_documented_on_its_page(pages):
    """A package without a page offers none."""
    for name in ["nvhchain", *(found.name for found in pkgutil.iter_modules(nvhchain.__path__, "nvhchain."))]:
        offered = getattr(importlib.import_module(name), "__all__", []) if name != "nvhchain.cli" else []
        page = pages.get(f"api/{name.removeprefix('nvhchain.')}", "")
        assert {f"{name}.{each}" for each in offered} <= {*re.findall(r"nvhchain\.[\w.]+", page)}
        assert page.count("Example") >= len(offered)


def test_the_script_in_the_readme_uses_names_that_exist():
    readme = (ROOT / "README.md").read_text()
    (script,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    compile(script, "README.md", "exec")
    for name in re.findall(r"\bnvh\.(\w+)", script):
        assert hasattr(nvhchain, name)
    for module, imported in re.findall(r"^from (nvhchain[\w.]*) import (.+)$", script, re.MULTILINE):
        exec(f"from {module} import {imported}", {})
    for field in re.findall(r"\bresult\.(\w+)", script):
        assert field in {f.name for f in fields(Result)} or isinstance(
            getattr(Result, field), property | cached_property
        )


@pytest.mark.slow
def test_the_script_in_the_readme_prints_what_the_readme_shows(tmp_path):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script, shown = (re.search(rf"```{kind}\n(.*?)```", readme, re.DOTALL)[1] for kind in ("python", "text"))
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found, expected = ([float(n) for n in re.findall(r"\d+\.\d", text)] for text in (done.stdout, shown))
    assert found == pytest.approx(expected, abs=0.3)
    assert (tmp_path / "spectrum.png").exists()
    assert (tmp_path / "pressure.csv").read_text().startswith("frequency,")


def test_every_file_the_readme_points_to_exists():
    readme = (ROOT / "README.md").read_text()
    targets = [t for t in re.findall(r"\]\(([^)#]+)\)", readme) if "://" not in t]
    assert targets
    assert not [target for target in targets if not (ROOT / target).exists()]


PARTS = ("nvhchain", "tests", "benchmarks", "cases", "docs", "scripts")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(language):
    """Fenced blocks in a language, with the page they stand on."""
    for page in PAGES:
        for block in re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE):
            yield page.name, block


def test_command_lines_of_the_pages_are_understood_and_their_cases_exist():
    lines = [
        (page, line) for page, block in blocks("sh") for line in block.splitlines() if line.startswith("nvhchain ")
    ]
    assert len(lines) > 20
    for page, line in lines:
        words = shlex.split(line, comments=True)[1:]
        try:
            parser().parse_args(words)
        except SystemExit:
            pytest.fail(f"{page}: {line}")
        missing = [word for word in words if word.startswith("cases/") and not (ROOT / word).exists()]
        assert not missing, f"{page}: {line}"


CHECKED = ("new", "check", "plan", "schema", "export")
LONGER = ("housings.md", "own_housing.md")
"""Pages whose STEP part is surveyed; the second has a test of its own."""


def lines_of(page):
    """Command lines of a page, each as its words."""
    text = page.read_text(encoding="utf-8")
    found = [line for block in re.findall(r"^```sh\n(.*?)^```", text, re.S | re.M) for line in block.splitlines()]
    return [shlex.split(line, comments=True)[1:] for line in found if line.startswith("nvhchain ")]


def prepared(page, folder):
    """Put the files of a page into a folder: named extracts, examples of the repository, and those of `new`."""
    (folder / "cases").symlink_to(ROOT / "cases")
    for case in (ROOT / "cases" / "small").iterdir():
        (folder / case.name).write_bytes(case.read_bytes())
    if any(words[0] == "import" for words in lines_of(page)):
        assert main(["export", "cases/small/single_stage.toml", "--out", "unit.rexs"]) == 0
    for extract in re.findall(r"^```toml\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M):
        if named := re.match(r"# (\w+\.toml)", extract):
            (folder / named[1]).write_text(extract, encoding="utf-8")


def outcomes(page, folder, commands):
    """Exit codes of the lines of a page with these commands."""
    prepared(page, folder)
    done = {}
    for words in lines_of(page):
        if words[0] == "new":
            for case in (ROOT / "cases" / "small").iterdir():
                if words[-1] == ".":
                    (folder / case.name).unlink(missing_ok=True)
        if words[0] in commands:
            done[" ".join(words)] = main(words)
    return done


@pytest.mark.parametrize("page", [page for page in PAGES if page.name not in LONGER], ids=lambda page: page.name)
def test_lines_that_check_and_plan_end_well(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = outcomes(page, tmp_path, CHECKED)
    assert {code for code in done.values()} <= {0}, done


@pytest.mark.slow
def test_lines_that_check_and_plan_a_step_part_end_well(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = outcomes(ROOT / "docs" / "howto" / "housings.md", tmp_path, CHECKED)
    assert done
    assert {code for code in done.values()} <= {0}, done


@pytest.mark.slow
@pytest.mark.parametrize("page", ["rattle", "deviations", "rexs"])
def test_lines_that_run_small_cases_end_well(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = outcomes(ROOT / "docs" / "howto" / f"{page}.md", tmp_path, ("run", "import"))
    assert done
    assert {code for code in done.values()} <= {0}, done


def test_scripts_of_the_pages_compile_and_import_names_that_exist():
    scripts = list(blocks("python"))
    assert len(scripts) > 6
    for page, script in scripts:
        tree = ast.parse(script, page)
        for node in ast.walk(tree):
            elsewhere = getattr(node, "module", None) == "dask_jobqueue"  # on the machine of a batch system
            if isinstance(node, ast.Import | ast.ImportFrom) and not elsewhere:
                exec(ast.unparse(node), {})
        for name in re.findall(r"\bnvh\.(\w+)", script):
            assert hasattr(nvhchain, name), f"{page}: nvh.{name}"


def test_extracts_of_case_files_are_toml():
    extracts = list(blocks("toml"))
    assert extracts
    for _, extract in extracts:
        tomllib.loads(extract)


def test_files_that_the_pages_name_exist():
    """Decisions aside, which keep the names of their day."""
    known = {path.relative_to(ROOT).as_posix() for part in PARTS for path in (ROOT / part).rglob("*.*")}
    for page in (page for page in PAGES if page.parent.name != "decisions"):
        for code in re.findall(r"`([^`\n]+)`", page.read_text()):
            for name in re.findall(r"[\w./-]+\.(?:py|toml|sh|md)\b", code):
                if name.split("/")[0] in PARTS:
                    assert name in known, f"{page.name}: {name}"
                elif name.endswith(".py"):
                    assert any(f"/{path}".endswith(f"/{name}") for path in known), f"{page.name}: {name}"
