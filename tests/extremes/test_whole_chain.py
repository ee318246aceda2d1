"""The chain as a user runs it, at every size: right against closed forms and against its own error band, or refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nvhchain as nvh
from nvhchain.acoustics import radiate, sphere, transfer_vectors
from nvhchain.case import FieldPoint, RadiatorCase, Sphere
from nvhchain.conventions import Air
from nvhchain.error_band import Origin, error_band
from nvhchain.fidelity import DRAFT
from nvhchain.handoff import ForceSpectrum, ReducedHousing
from nvhchain.housing import respond
from nvhchain.levels import decibel
from nvhchain.testing.scales import mostly, powers


@given(
    radius=powers(1e-5, 1e3), ka=powers(1e-5, 3.0),
    away=powers(1e-2, 1e5), speed=powers(1.0, 1e4), density=powers(1e-3, 2e3), pulsation=powers(1e-15, 1e9),
)  # fmt: skip
def test_the_case_of_a_pulsating_sphere_of_any_size_is_within_its_band_or_refused(
    tried, radius, ka, away, speed, density, pulsation
):
    """ρc v jka² e^{−jk(r−a)}/(r (1 + jka)) (Morse & Ingard 1968, eq. 7.1.4), ½ ρc v² 4πa² (ka)²/(1 + (ka)²)."""
    frequencies = (ka * speed / (2 * np.pi * radius),)
    case = tried(
        lambda: RadiatorCase(
            "ball", Sphere(radius), frequencies, (FieldPoint("p", (0.0, 0.0, radius * (1 + away))),),
            pulsation=pulsation, air=Air(speed, density), quantities=("pressure", "sound_power"),
        )
    )  # fmt: skip
    result = tried(nvh.run, case, fidelity=DRAFT) if case is not None else None
    if result is None:
        return
    impedance = speed * density
    pressure = impedance * pulsation * ka / np.hypot(1.0, ka) / (1 + away)
    band = result.error_band
    level = decibel(pressure)
    assert ((band.lower <= level) & (level <= band.upper)).all()
    power = 0.5 * impedance * pulsation**2 * 4 * np.pi * radius**2 * ka**2 / (1 + ka**2)
    band = result.error_bands["sound_power"]
    level = 10 * np.log10(power / 1e-12)
    assert ((band.lower <= level) & (level <= band.upper)).all()


@pytest.fixture(scope="module")
def case(request):
    base = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    return replace(base, quantities=("bearing_forces",), field_points=())


def ball_housing(scale, names, positions):
    """A ball of `scale` decimetres with two modes that breathe and swing, of its own size and mass."""
    ball = sphere(0.1 * scale, 1)
    mass = scale**1.5
    return ReducedHousing(
        natural_frequency=np.array([500.0, 1300.0]) / scale,
        modal_damping=np.full(2, 0.02),
        seat_shapes=np.full((2, len(names), 3), 0.3) / mass,
        normal_shapes=np.stack([np.ones(80), ball.normals[:, 2]]) / mass,
        seat_residual=1e-10 / scale * np.eye(3 * len(names)).reshape(len(names), 3, len(names), 3),
        face_residual=1e-10 / scale * np.tile(ball.normals[:, 2], (len(names), 3, 1)),
        names=names,
        positions=positions,
        surface=ball,
    )


@pytest.mark.slow
@given(scale=powers(1e-5, 1e4), force=powers(1e-12, 1e12), seed=st.integers(0, 99))
def test_housing_and_sound_of_any_size_are_those_of_the_unit_scaled(tried, case, scale, force, seed):
    """Lengths s, frequencies 1/s, forces s²: velocities and pressures are the same, the error band in decibels too."""
    names = ("A1", "B1")
    lines = np.array([300.0, 480.0, 620.0, 900.0])
    amplitudes = np.random.default_rng(seed).standard_normal((4, 2, 3)) + 0j
    found = []
    for size, load in ((1.0, 1.0), (scale, force)):
        forces = ForceSpectrum(lines / size, load * size**2 * amplitudes, names, input_speed=188.5 / size)
        housing = ball_housing(size, names, np.zeros((2, 3)))
        velocity = tried(respond, housing, forces)
        vectors = tried(
            transfer_vectors, housing.surface, [[0.0, 0.3 * size, 0.9 * size]], lines / size, fidelity=DRAFT.acoustics
        )
        if velocity is None or vectors is None:
            return
        pressure = radiate(vectors, velocity, fidelity=DRAFT.acoustics)
        band = error_band(Origin(case, DRAFT), pressure, velocity, transfer_vectors=vectors)
        found.append((pressure.pressure / load, band.upper - decibel(pressure.pressure)))
    (one, width), (other, its) = found
    assert np.abs(other - one).max() < 1e-9 * np.abs(one).max()
    assert its == pytest.approx(width, rel=1e-6, abs=1e-9)


@given(
    speed=mostly(powers(1e-3, 1e5)), torque=mostly(powers(1e-6, 1e8)), low=mostly(powers(1e-2, 1e4)),
    high=mostly(powers(1.0, 1e5)), resolution=mostly(powers(1e-2, 1e4)), z=mostly(powers(1e-3, 1e3)),
)  # fmt: skip
def test_any_operation_band_and_point_of_a_gearbox_is_planned_or_refused(
    tried, case, speed, torque, low, high, resolution, z
):
    """`plan` sees all that a run would refuse before it begins, and predicts finite seconds and memory."""
    operation = tried(lambda: replace(case.operation, input_speed=speed, input_torque=torque))
    band = tried(lambda: replace(case.band, low=low, high=high, resolution=resolution))
    if operation is None or band is None:
        return
    asked = tried(
        lambda: replace(
            case, operation=operation, band=band, quantities=("pressure",), field_points=(FieldPoint("p", (0, 0, z)),)
        )
    )
    plan = tried(nvh.plan, asked, fidelity=DRAFT) if asked is not None else None
    assert plan is None or "nan" not in str(plan).lower()
