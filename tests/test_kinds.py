"""Arguments of the wrong kind: one clear refusal, whatever the function."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NotRequired, TypedDict, Unpack

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import case, dynamics, interop, lumped
from nvhchain.errors import InputError
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, HousingFidelity
from nvhchain.handoff import BearingForces, FloatArray
from nvhchain.kinds import checked
from nvhchain.report import compare
from nvhchain.tradeoff import cheapest, tradeoff


class Named(TypedDict):
    speed: float
    watcher: NotRequired[Callable[[int], None] | None]


@checked
def told(
    number: float,
    count: int = 1,
    array: FloatArray = np.zeros(1),  # noqa: B008
    place: tuple[float, float] = (0.0, 0.0),
    several: Sequence[str] = (),
    by_name: Mapping[str, float] | None = None,
    path: str | Path = ".",
    about: Mapping[str, Any] | None = None,
    **named: Unpack[Named],
) -> None:
    pass


def test_what_fits_the_annotations_passes():
    told(np.float32(1.0), np.int64(2), [1, 2.0], [0, 1], ["a"], {"a": 1}, Path(), {"a": print}, speed=1, watcher=print)
    told(1, speed=2.0, watcher=None)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("number", "1.0"), ("number", None), ("number", [1.0]), ("number", 1j), ("number", True),
        ("count", "2"), ("array", "x"), ("array", [[1], [1, 2]]), ("array", None), ("array", [1j]),
        ("place", 1.0), ("place", (0.0,)), ("place", "xy"), ("several", "a"), ("several", [1.0]), ("several", None),
        ("by_name", 1.0), ("by_name", {"a": "b"}), ("about", [1]), ("path", 3), ("speed", "fast"), ("watcher", 3),
    ],
)  # fmt: skip
def test_what_does_not_is_refused_by_name_and_value(name, value):
    given = {"number": 1.0, "speed": 1.0, name: value}
    with pytest.raises(InputError, match=rf"told: {name} = .* is of the wrong kind: give "):
        told(**given)


def test_a_name_or_path_in_place_of_what_it_stands_for_is_told_where_to_get_that():
    with pytest.raises(InputError, match=r"fidelity = 'draft' .* give nvhchain\.DRAFT, .* or another Fidelity"):
        nvh.run(SPHERE, fidelity="draft")
    with pytest.raises(InputError, match=r"'a\.toml' .* a GearboxCase or a RadiatorCase, as load_case returns them"):
        nvh.run("a.toml", fidelity=nvh.DRAFT)


def test_a_checked_function_keeps_its_signature_and_its_own_words_for_missing_arguments():
    assert inspect.signature(told).parameters.keys() == inspect.signature(told.__wrapped__).parameters.keys()
    assert (told.__name__, told.__module__) == (told.__wrapped__.__name__, __name__)
    with pytest.raises(TypeError, match=r"told\(\) missing 1 required positional argument: 'number'"):
        told(speed=1.0)


def test_names_of_a_run_up_that_are_missing_or_unknown_are_told():
    with pytest.raises(TypeError, match="missing keyword arguments: speed"):
        told(1.0)
    with pytest.raises(TypeError, match="unexpected keyword arguments: sped"):
        told(1.0, speed=1.0, sped=2.0)


SPHERE = case.RadiatorCase("sphere", case.Sphere(0.1), (100.0,), (case.FieldPoint("ear", (0.0, 0.0, 1.0)),), 1.0)
FORCES = BearingForces(np.arange(3.0), np.zeros((3, 1, 3)), ("a",), np.zeros((1, 3)), 1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: dynamics.RigidBody("0", 1.0, 1.0, 1.0),
        lambda: dynamics.Gearbox(None, (), (), "A", "B"),
        lambda: dynamics.MeshFriction("0.05", 1.0, [0.0], [0.0], [0.0]),
        lambda: dynamics.train(None, ()),
        lambda: dynamics.bearing_forces(
            None, (), None, input_speed="9", input_torque=1.0, f_max=1.0, fidelity=DynamicsFidelity(1e-5)
        ),
        lambda: DynamicsFidelity("1e-5"),
        lambda: lumped.GearPair("1", 1.0, np.ones(8), 1, 0.1),
        lambda: lumped.steady_sweep([], ["500"]),
        lambda: lumped.thesis_pair("d", torque="350"),
        lambda: lumped.Windows([1e-5], ["3"], [0.0], [500.0], [0]),
        lambda: lumped.backbone_frequency(float("nan")),
        lambda: lumped.mesh_cross_response(lumped.FITTED_RIG, 100.0, mesh="test", due_to="test"),
        lambda: interop.read_record(None),
        lambda: interop.write_bearing_forces(FORCES, None),
        lambda: interop.BearingChannels("a", "x", "y", "z", "here"),
        lambda: FORCES.sort_bearings(None),
        lambda: FORCES.replace(names=3),
        lambda: FORCES.replace(input_speed="9"),
        lambda: FORCES.replace(periodic="no"),
        lambda: DynamicsFidelity(1e-5, path_correction="no"),
        lambda: HousingFidelity(0.01, residual_flexibility="no"),
        lambda: AcousticsFidelity(3.0, 64, close_orders=6),
        lambda: case.Band("10", 100.0),
        lambda: case.FieldPoint("ear", (0.0, 1.0)),
        lambda: case.Operation("9", 1.0),
        lambda: case.Options(tilt="no"),
        lambda: replace(SPHERE, frequencies=100.0),
        lambda: replace(SPHERE, quantities=("loudness",)),
        lambda: nvh.load_case(3),
        lambda: nvh.run("cases/gearbox/solid.toml"),
        lambda: nvh.run(SPHERE, fidelity="draft"),
        lambda: nvh.run(SPHERE, watcher=print),
        lambda: nvh.plan(SPHERE, fidelity=None),
        lambda: compare(SPHERE),
        lambda: cheapest(SPHERE, "1"),
        lambda: tradeoff(None, out="."),
    ],
)
def test_public_functions_refuse_what_is_of_the_wrong_kind(wrong):
    with pytest.raises(InputError):
        wrong()
