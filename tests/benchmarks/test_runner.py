"""Benchmarks are listed, found by name and importable; measured pages state where they come from."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import publish
from benchmarks.__main__ import benchmarks, index

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted(path for path in (ROOT / "benchmarks").rglob("*.py"))
PAGES = sorted((ROOT / "docs" / "measured").rglob("*.md"))


def module(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def run(*words):
    command = [sys.executable, "-m", "benchmarks", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_every_benchmark_is_listed_once_with_a_sentence_and_its_command():
    runnable = [path for path in SCRIPTS if path.name != "__main__.py" and "\nif __name__ ==" in path.read_text()]
    listed, lines = benchmarks(), index()
    assert sorted(listed) == sorted(path.stem for path in runnable)
    for one in listed.values():
        assert re.fullmatch(r"[A-Z].{10,110}\.", one.summary), one.name
        assert one.usage, one.name
        assert all(f"python -m benchmarks {one.name}" in line for line in one.usage), one.usage
        assert f"  {one.name} " in lines


def test_every_benchmark_imports_and_finds_its_folders():
    """All but the peer that needs bempp-cl; in a process of their own, as they extend the path."""
    names = [module(path) for path in SCRIPTS if path.stem not in ("bempp_operators", "__init__", "__main__")]
    script = """if True:
        import importlib, json, sys
        from pathlib import Path
        missing = []
        for name in json.loads(sys.argv[1]):
            found = vars(importlib.import_module(name))
            places = {key: found[key] for key in ("ROOT", "CASE", "CASES", "MEASURED", "DATA") if key in found}
            paths = {key: place if isinstance(place, list) else [place] for key, place in places.items()}
            missing += [f"{name}.{key}" for key, of in paths.items() if not all(Path(one).exists() for one in of)]
            if "ROOT" in places and not (places["ROOT"] / "pyproject.toml").exists():
                missing.append(f"{name}.ROOT")
        print(json.dumps(missing))
    """
    done = subprocess.run(
        [sys.executable, "-c", script, json.dumps(names)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == []


def test_processes_that_benchmarks_start_are_modules_that_exist():
    scripts = [path for path in SCRIPTS if path.stem != "publish"]
    started = {(path, name) for path in scripts for name in re.findall(r'"-m", "(benchmarks[\w.]*)"', path.read_text())}
    assert len(started) > 5
    for path, name in started:
        assert name == module(path)
    assert not [path for path in SCRIPTS if "sys.executable, __file__" in path.read_text()]


def test_a_name_that_does_not_exist_ends_with_the_nearest_one():
    done = run("mastres", "out")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "nearest name: masters" in done.stderr


def test_a_missing_folder_ends_with_the_command_line():
    done = run("masters")
    assert done.returncode == 2
    assert done.stderr == "masters needs arguments: python -m benchmarks masters OUT [wide narrow close]\n"


def test_a_benchmark_runs_under_its_own_name_with_its_arguments(tmp_path):
    """`boundary_elements` reads its arguments by a parser, which prints what it was called."""
    done = run("boundary_elements", str(tmp_path), "--peers", "many")
    assert done.returncode == 2
    assert "boundary_elements.py: error: argument --peers: invalid int value: 'many'" in done.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_measured_page_states_date_machine_commit_and_command(page):
    stated = re.search(
        r"^(?:Last m|M)easured \d{4}-\d\d-\d\d at commit [0-9a-f]{7,}(?: \+ changes)?, .*cores?.*: `.*python .+`\.$",
        "\n".join(page.read_text().splitlines()[:3]),
        re.MULTILINE,
    )
    assert stated
    script = re.search(r"-m benchmarks (\w+)|python ([\w/]+\.py)", stated[0])
    assert script[1] in benchmarks() if script[1] else (ROOT / script[2]).exists()


def test_every_measured_page_is_included_by_a_page_of_the_documentation():
    pages = [page for page in (ROOT / "docs").rglob("*.md") if page not in PAGES]
    found = {
        (page.parent / name).resolve() for page in pages for name in re.findall(r"\{include\} (\S+)", page.read_text())
    }
    assert set(PAGES) <= found


def test_every_measured_page_has_the_row_of_its_benchmark_in_the_index():
    """And the row links to a page that includes it."""
    index_page = ROOT / "docs" / "validation" / "measurements.md"
    rows = [row.split(" | ") for row in index_page.read_text().splitlines() if row.startswith("| [")]
    missing = []
    for page in PAGES:
        measured = re.search(r"-m benchmarks \w+|python [\w/]+\.py", page.read_text())[0]
        named = [link for link, _, command in rows if re.search(rf"{measured}\b", command)]
        places = {(index_page.parent / re.search(r"\((.+?)#", link)[1]).resolve() for link in named}
        includes = f"/measured/{page.relative_to(ROOT / 'docs' / 'measured')}\n"
        if not any(includes in place.read_text() for place in places):
            missing.append(str(page.relative_to(ROOT)))
    assert len(rows) > 50
    assert missing == []


def test_a_published_page_states_its_source_below_its_heading(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(publish, "MEASURED", tmp_path)
    argv = [str(ROOT / "benchmarks" / "gear" / "gear.py"), str(tmp_path), "law", f"opencl={tmp_path}/python"]
    monkeypatch.setattr(sys, "argv", argv)
    publish.publish("gear/some", "# Heading\n\n| a |\n")
    heading, _, line, _, table = (tmp_path / "gear" / "some.md").read_text().splitlines()
    assert (heading, table) == ("# Heading", "| a |")
    assert line.endswith(": `python -m benchmarks gear OUT law opencl=PATH`.")
    assert re.match(r"Measured \d{4}-\d\d-\d\d at commit \w+(?: \+ changes)?, .+, \d+ cores?, \d+ GB: ", line)
    assert str(tmp_path) not in line
    assert "| a |" in capsys.readouterr().out
