"""Arguments of the wrong kind to what acoustics offers end in one clear InputError."""

import inspect
import typing

import numpy as np
import pytest
from numpy.typing import ArrayLike

from nvhchain import acoustics
from nvhchain.acoustics import Adaptive, Work, sphere, transfer_vectors
from nvhchain.conventions import Air
from nvhchain.errors import InputError
from nvhchain.fidelity import STANDARD
from nvhchain.handoff import SurfaceVelocity, TransferVectors

BODY = sphere(0.1, 1)
AT_REST = SurfaceVelocity([100.0], np.zeros((1, 80)), BODY)
AIR = Air(343.0, 1.21)
VECTORS = TransferVectors([100.0, 200.0], [[0.0, 0.0, 1.0]], np.ones((2, 1, 80)), BODY, AIR)
NAMES = [name for name in dir(acoustics) if not name.startswith("_") and name != "deferred"]
FUNCTIONS = {name: one for name in NAMES if inspect.isfunction(one := getattr(acoustics, name))}
CASES = [
    (name, argument)
    for name, function in FUNCTIONS.items()
    for argument in typing.get_type_hints(function)
    if argument != "return"
]


def placeholder(kind):
    """Something that passes for an argument of this kind and is never looked into."""
    if kind == ArrayLike or typing.get_origin(kind) is np.ndarray:
        return np.ones(1)
    if inner := typing.get_args(kind):
        return None if type(None) in inner else False if bool in inner else ()
    simple = {float: 1.0, int: 1, str: "fused", bool: False}
    return simple[kind] if kind in simple else object.__new__(kind)


@pytest.mark.parametrize(("name", "argument"), CASES)
def test_every_argument_of_every_function_is_refused_by_its_name_if_it_is_of_the_wrong_kind(name, argument):
    kinds = typing.get_type_hints(FUNCTIONS[name])
    kinds.pop("return")
    for wrong in (object(), {"a": 1}, [None]):
        arguments = {one: placeholder(kind) for one, kind in kinds.items()} | {argument: wrong}
        with pytest.raises(InputError, match=rf"^{name}: {argument} = .* is of the wrong kind: give "):
            FUNCTIONS[name](**arguments)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: transfer_vectors(BODY, [0, 0, 1], [100.0], plane=(0, 0, 1)), r"plane = .* give a RigidPlane or None$"),
        (lambda: transfer_vectors(BODY, [0, 0, 1], [100.0], engine=["fused"]), r"engine = .* give a text$"),
        (lambda: Work(checkpoints=5), r"checkpoints = 5 .* a path or None$"),
        (lambda: Work(progress=3), r"progress = 3 .* a function or None$"),
        (lambda: transfer_vectors(BODY, None, [100.0]), r"points = None .* give numbers"),
        (lambda: transfer_vectors(BODY, [0, 0, 1], Adaptive("50", 100.0)), r"low = '50' .* give a number$"),
        (lambda: Adaptive(50.0, None), r"high = None .* give a number$"),
        (lambda: transfer_vectors(BODY, [0, 0, 1], Adaptive(-1.0, 5.0)), r"band -1…5 Hz is empty"),
        (lambda: acoustics.sound_power(AT_REST, array_radius="1 m"), r"array_radius = '1 m' .* a number or None$"),
        (lambda: acoustics.sound_power(AT_REST, array_radius=np.nan), r"array radius nan m must be positive"),
        (lambda: sphere("0.1", 2), r"radius = '0.1' .* give a number$"),
        (lambda: sphere(0.1, 2.5), r"subdivisions 2.5 must be a whole number"),
        (lambda: sphere(np.nan, 2), r"sphere radius nan m must be positive"),
        (lambda: sphere(0.1, 2, [0, 0]), r"three finite coordinates"),
    ],
)
def test_what_users_mistake_is_named_with_the_remedy(call, told):
    with pytest.raises(InputError, match=told):
        call()


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: acoustics.interpolate_vectors(VECTORS, [np.nan]), "finite and not negative"),
        (lambda: acoustics.check_mesh(BODY, np.inf, AIR, STANDARD.acoustics), "inf Hz is not finite"),
        (lambda: acoustics.required_element_size(np.inf, AIR, STANDARD.acoustics), "positive and finite"),
        (lambda: acoustics.convolution_lines(1000.0, 100.0, np.inf), "both finite"),
        (lambda: acoustics.convolution_lines(np.inf, 100.0, 1.0), "both finite"),
        (lambda: acoustics.expected_radiation_error("rayleigh", np.inf), "positive and finite"),
        (lambda: acoustics.expected_radiation_error("rayleigh", []), "positive and finite"),
        (lambda: acoustics.array_points(1.0, [0, 0, 1j]), "real numbers are needed"),
    ],
)
def test_numbers_that_no_physics_belongs_to_are_refused(call, told):
    with pytest.raises(InputError, match=told):
        call()


def test_numbers_of_every_numeric_type_pass_for_real_and_whole_numbers():
    one = sphere(np.float32(0.25), np.int64(1), (0, 0, 0))
    assert np.array_equal(one.vertices, sphere(0.25, 1.0).vertices)
