"""Packages of the extras: where one is missing, one line names the command that installs it, and the rest works."""

import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import case, doctor
from nvhchain.acoustics import solve_direct
from nvhchain.acoustics.surfaces.surface import sphere
from nvhchain.errors import InputError
from nvhchain.handoff import SurfaceVelocity
from nvhchain.interop import read_record
from nvhchain.plots.bodies.surface import surface_velocity
from nvhchain.runtime.extras import EXTRAS

BODY = sphere(0.1, 1)
MOVING = SurfaceVelocity([100.0], np.ones((1, len(BODY.triangles))), BODY)
CASE = case.RadiatorCase("s", case.Sphere(0.1), (100.0,), (case.FieldPoint("a", (0.0, 0.0, 1.0)),), 1.0)


@pytest.fixture
def without(monkeypatch):
    """Hide a module as if it were not installed."""
    return lambda module: monkeypatch.setitem(sys.modules, module, None)


def test_forces_in_a_universal_file_name_the_extra_that_reads_them(without, tmp_path):
    without("pyuff")
    (tmp_path / "a.uff").write_text("    -1\n    58\n    -1\n")
    with pytest.raises(InputError, match=r'pyuff is not installed: pip install "nvhchain\[uff\]"$'):
        read_record(tmp_path / "a.uff")


def test_the_second_engine_is_refused_before_any_work(without):
    without("bempp_cl")
    refused = pytest.raises(InputError, match=r'bempp_cl is not installed: pip install "nvhchain\[bempp\]"$')
    with refused:
        solve_direct(MOVING, [[0.0, 0.0, 1.0]], engine="bempp")
    with refused:
        nvh.run(replace(CASE, engine="bempp"), fidelity=nvh.DRAFT)
    nvh.plan(CASE, fidelity=nvh.DRAFT)


def test_pictures_are_drawn_by_matplotlib_unless_pyvista_is_asked_for(without):
    without("pyvista")
    with pytest.raises(InputError, match=r'pyvista is not installed: pip install "nvhchain\[pictures\]"$'):
        surface_velocity(MOVING, engine="pyvista")
    assert surface_velocity(MOVING, engine="matplotlib").collections


def test_a_machine_without_the_extras_is_sound(without):
    for module in EXTRAS:
        without(module)
    for finding in (doctor._bempp(), doctor._renderer()):
        assert finding.ok
        assert 'pip install "nvhchain[' in finding.detail


def test_extras_are_those_of_the_project(request):
    declared = tomllib.loads((request.config.rootpath / "pyproject.toml").read_text())["project"]
    assert set(EXTRAS.values()) <= set(declared["optional-dependencies"])
    assert not any(line.startswith(("bempp", "pyvista", "pyuff")) for line in declared["dependencies"])
