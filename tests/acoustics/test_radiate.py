"""What `radiate` says about its own interpolation."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import radiation_cases as cases

from nvhchain.acoustics import radiate, sphere
from nvhchain.errors import AccuracyWarning
from nvhchain.handoff import SurfaceVelocity

POINTS = np.array([[1.0, 0.2, 0.0], [0.0, -1.3, 0.4]])


def test_interpolation_that_errs_more_than_asked_is_warned_of_with_the_number(air, coarse):
    """A detour of 0.5 m between masters 100 Hz apart: straight lines join what turns by 0.9 rad."""
    body, masters, lines = sphere(0.1, 1), np.linspace(1000.0, 2000.0, 11), np.linspace(1000.0, 2000.0, 41)
    turn = np.exp(-2j * np.pi * 0.5 / air.speed_of_sound * masters)[:, None, None]
    atv = cases.monopoles(body, POINTS, masters, air)
    atv = atv.replace(vectors=atv.vectors * turn)
    velocity = SurfaceVelocity(lines, np.ones((41, len(body.triangles))), body)
    exact = cases.monopoles(body, POINTS, lines, air).vectors.sum(axis=2)
    exact = exact * np.exp(-2j * np.pi * 0.5 / air.speed_of_sound * lines)[:, None]
    linear = replace(coarse, interpolation="linear")
    with pytest.warns(
        AccuracyWarning, match=r"errs by an estimated [\d.]+ dB .* 0\.1 dB asked: take more masters"
    ) as said:
        field = radiate(atv, velocity, fidelity=linear)
    told = float(str(said[0].message).split("estimated ")[1].split(" dB")[0])
    relative = np.abs(field.pressure - exact).max(axis=0) / np.abs(exact).max(axis=0)
    truth = 20 * np.log10(1 + relative.max())
    assert truth / 3 < told < truth * 3
    assert told == pytest.approx(20 * np.log10(1 + max(field.provenance["interpolation_error"])), rel=0.02)


def test_interpolation_as_good_as_asked_is_quiet(air, coarse):
    body, masters, lines = sphere(0.1, 1), np.linspace(100.0, 2000.0, 11), np.linspace(100.0, 2000.0, 41)
    velocity = SurfaceVelocity(lines, np.ones((41, len(body.triangles))), body)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        radiate(cases.monopoles(body, POINTS, masters, air), velocity, fidelity=coarse)
