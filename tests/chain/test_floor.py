"""A sphere over a rigid floor, from its case file: the plane and the workers reach the boundary elements."""

from dataclasses import replace
from inspect import unwrap

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import RigidPlane
from nvhchain.runtime.cluster import connect


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "sphere" / "on_floor.toml")


def free_sphere(case, distance, frequency):
    """Pulsating sphere (Morse & Ingard 1968, eq. 7.1.4 in e^{+jωt}): ρ c v jk a² e^{−jk(r−a)} / (r (1 + jka))."""
    k, a, r = 2 * np.pi * frequency / case.air.speed_of_sound, case.body.radius, distance
    amplitude = case.air.impedance * case.pulsation * 1j * k * a**2 / (r * (1 + 1j * k * a))
    return amplitude * np.exp(-1j * k * (r - a))


def test_sphere_over_floor_is_the_sum_of_sphere_and_mirror_image_within_one_percent(case):
    pressure = nvh.run(case).pressure
    for m, point in enumerate(case.field_points):
        near, far = (np.linalg.norm(np.array(point.position) - [0, 0, z]) for z in (0.5, -0.5))
        exact = free_sphere(case, near, pressure.frequency) + free_sphere(case, far, pressure.frequency)
        assert np.abs(pressure.pressure[:, m] - exact).max() < 0.01 * np.abs(exact).max()


def test_field_point_behind_the_floor_is_refused_with_its_depth(case):
    low = replace(case.field_points[0], position=(1.0, 0.0, -0.02))
    with pytest.raises(InputError, match=r"lies 20 mm behind the reflecting plane"):
        replace(case, field_points=(low,))


def test_body_behind_the_floor_is_refused_before_any_work(case, request):
    floor = RigidPlane((0.0, 0.0, 0.495), (0.0, 0.0, 1.0))
    with pytest.raises(InputError, match="centre is 5 mm above the plane"):
        replace(case, reflecting_plane=floor, field_points=case.field_points[1:])
    gearbox = nvh.load_case(request.config.rootpath / "cases" / "gearbox" / "solid.toml")
    floor = RigidPlane((0.0, -0.05, 0.0), (0.0, 1.0, 0.0))
    with pytest.raises(InputError, match="mm behind the plane: move"):
        replace(gearbox, reflecting_plane=floor)


def test_transfer_vectors_of_a_free_field_are_refused_over_a_floor(case):
    free = nvh.run(replace(case, reflecting_plane=None)).transfer_vectors
    with pytest.raises(InputError, match="reflecting plane None"):
        nvh.run(case, transfer_vectors=free)


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "alike"), [("double", 1e-10), ("single", 3e-6)])
def test_work_spread_over_worker_processes_gives_the_same_pressure(case, request, tmp_path, capsys, precision, alike):
    """To rounding of the matrices: workers solve other groups of lines together."""
    path = str(request.config.rootpath / "cases" / "sphere" / "on_floor.toml")
    changed = ["--set", f"fidelity.acoustics.precision={precision}"]
    assert main(["run", path, "--workers", "2", "--out", str(tmp_path), *changed]) == 0
    capsys.readouterr()
    spread = hdf5.load(tmp_path / "pressure.h5")
    knobs = replace(nvh.STANDARD.acoustics, precision=precision)
    here = nvh.run(case, fidelity=replace(nvh.STANDARD, acoustics=knobs)).pressure.pressure
    assert np.abs(spread.pressure - here).max() < alike * np.abs(here).max()


def test_scheduler_that_does_not_answer_is_bad_input(request, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(unwrap(connect).__kwdefaults__, "timeout", 0.5)
    path = str(request.config.rootpath / "cases" / "sphere" / "on_floor.toml")
    assert main(["run", path, "--scheduler", "tcp://127.0.0.1:1", "--out", str(tmp_path)]) == 2
    assert "127.0.0.1:1" in capsys.readouterr().err
