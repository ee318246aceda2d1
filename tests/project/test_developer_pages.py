"""Examples of the developer pages run as they stand."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nvhchain import STANDARD
from nvhchain.acoustics import ENGINES, sphere, transfer_vectors
from nvhchain.errors import FileFormatError
from nvhchain.fem.mesh_files import read, read_mesh
from nvhchain.fidelity.knob import Sweep, knob

PAGES = Path(__file__).parents[2] / "docs" / "developers"


def run(page):
    names: dict = {"__name__": "example"}
    for block in re.findall(r"```python\n(.*?)```", (PAGES / page).read_text(encoding="utf-8"), re.S):
        exec(compile(block, page, "exec"), names)
    return names


def test_the_example_of_a_file_format_reads_and_refuses(tmp_path, monkeypatch):
    monkeypatch.setitem(read._READERS, ".tri", None)  # and so it is forgotten afterwards
    run("add_a_file_format.md")
    path = tmp_path / "body.tri"
    corners = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    path.write_text(f"tri\n4 2\n{corners}0 1 2\n0 1 3\n")
    mesh = read_mesh(path)
    ((kind, cells),) = mesh.cells
    assert (mesh.points.shape, kind, cells.tolist()) == ((4, 3), "triangle", [[0, 1, 2], [0, 1, 3]])
    path.write_text(f"tri\n4 2\n{corners}0 1 2\n0 1 7\n")
    page = " ".join((PAGES / "add_a_file_format.md").read_text(encoding="utf-8").split())
    with pytest.raises(FileFormatError) as refused:
        read_mesh(path)
    assert str(refused.value).replace(f"{tmp_path}/", "") in page


def test_no_test_ignores_accuracy_warnings_of_all_kinds():
    blanket = re.compile(
        r"""ignore::nvh|simplefilter\(\s*['"]ignore|filterwarnings\(\s*['"]ignore['"]\s*(\)|,\s*category)"""
    )
    tests = [path for path in PAGES.parents[1].joinpath("tests").rglob("*.py") if path != Path(__file__)]
    assert [path for path in tests if blanket.search(path.read_text("utf-8"))] == []
    assert blanket.search("warnings.filterwarnings('ignore', category=AccuracyWarning)")
    assert not blanket.search('pytest.mark.filterwarnings("ignore:interpolation between")')


def test_declarations_of_knobs_are_accepted_as_the_page_writes_them():
    page = (PAGES / "add_a_knob.md").read_text(encoding="utf-8")
    declared = [f"1.5, low=0, {text.replace(', …', '')}" for text in re.findall(r"`(sweep=.*?|step=.*?)`", page)]
    declared += re.findall(r"= knob\((.*?)\n\)", page, re.S)
    assert len(declared) == 7
    for text in declared:
        assert eval(f"knob({text if 'meaning' in text else text + ', meaning=str()'})", {"Sweep": Sweep, "knob": knob})


def test_the_example_of_an_engine_solves_and_counts(monkeypatch):
    monkeypatch.setitem(ENGINES, "counted", None)
    engine = run("add_an_engine.md")["ENGINES"]["counted"]
    body, points, frequency = sphere(0.1, 1), np.array([[1.0, 0.0, 0.0]]), np.array([200.0, 400.0])
    double = replace(STANDARD.acoustics, precision="double")
    own, known = (
        transfer_vectors(body, points, frequency, engine=name, fidelity=double) for name in ("counted", "fused")
    )
    assert np.allclose(own.vectors, known.vectors, rtol=1e-12, atol=0.0)
    assert len(engine.seen) == 2
