"""Generated gearboxes through the whole chain, gear drawing to sound pressure: right against statics, against a direct
solution at the loudest line and against a scene of another size, or refused.
"""

from dataclasses import replace
from math import cos

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nvhchain as nvh
from nvhchain.acoustics import solve_direct
from nvhchain.fidelity import AcousticsFidelity, DynamicsFidelity, Fidelity, GearFidelity, HousingFidelity
from nvhchain.gear import Holes, Slots, Solid, ThinRim
from nvhchain.handoff import SurfaceVelocity
from nvhchain.levels import decibel
from nvhchain.testing.moved_gearbox import egg_housing, scaled
from nvhchain.testing.scales import ANY, MANY, powers

COARSE = Fidelity(
    "coarse",
    GearFidelity(profile_elements=2, width_layers=2, slices=5, angles_per_mesh=8, deflections_per_doubling=2,
                 row_aspect=2.5, load_pattern_tolerance=1e-2, bodies="analytic"),
    DynamicsFidelity(time_step=40e-6),
    HousingFidelity(element_size=0.03, elements_per_turn=6.0, elements_per_bending_wavelength=2.0),
    AcousticsFidelity(elements_per_wavelength=2.5, masters=64, master_tolerance_db=1.0),
)  # fmt: skip


@pytest.fixture(scope="module")
def case(request):
    base = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    return replace(base, band=replace(base.band, high=2500.0, resolution=120.0))


def drawn(data, case, wild):
    """The single stage with other gears, shafts apart as they need, torque and speed; one number anything if `wild`."""

    def number(name, good):
        return data.draw(ANY if wild == name else good, label=name)

    pinion, wheel = case.gears
    teeth = data.draw(st.integers(18, 40), label="teeth"), data.draw(st.integers(18, 60), label="teeth")
    helix = number("helix", st.floats(-0.4, 0.4))
    module = pinion.geometry.normal_module
    radii = [0.5 * module * z / cos(helix) for z in teeth]
    root = radii[1] - 1.25 * module
    blank = data.draw(st.sampled_from([
        Solid(), Slots(5, 0.6 * root, 0.8 * root, 0.6), Holes(4, 0.7 * root, 0.1 * root),
        ThinRim(0.005, 0.55 * root, 0.85 * root),
    ]), label="blank")  # fmt: skip
    gears = (
        replace(pinion, geometry=replace(pinion.geometry, teeth=teeth[0], helix_angle=helix)),
        replace(wheel, geometry=replace(wheel.geometry, teeth=teeth[1], helix_angle=-helix), blank=blank),
    )
    distance = sum(radii)
    shaft, other = case.shafts
    casting = case.housing
    bores = tuple(
        replace(bore, centre=(distance if bore.name[0] == "B" else 0.0, 0.0, bore.centre[2])) for bore in casting.bores
    )
    spaces = tuple(
        replace(space, centre=(x, 0.0), radius=1.2 * r + 0.006)
        for space, x, r in zip(casting.gear_spaces, (0.0, distance), radii, strict=True)
    )
    damping = number("damping", powers(1e-3, 0.3))
    return replace(
        case,
        operation=replace(
            case.operation,
            input_speed=number("speed", powers(80.0, 400.0)),
            input_torque=number("torque", powers(0.5, 500.0)),
        ),
        gears=gears,
        stages=(replace(case.stages[0], centre_distance=distance),),
        shafts=(shaft, replace(other, axis=(distance, 0.0))),
        housing=replace(casting, bores=bores, gear_spaces=spaces, modal_damping=damping),
        field_points=(replace(case.field_points[0], position=(0.02, -0.01, number("point", st.floats(0.5, 50.0)))),),
    )


def check(case, result, knobs):
    """Mean forces are those of statics, as far as flanks that part let them; the loudest line is that solved alone."""
    stage, force, pressure = case.pairs[0], result.bearing_forces, result.pressure
    mean, most = force.force.mean(axis=0), np.abs(force.force).max()
    assert bool(np.isfinite(pressure.pressure).all())
    teeth = [gear.geometry.teeth for gear in case.gears]
    tangential = case.operation.input_torque * sum(teeth) / (teeth[0] * stage.centre_distance)
    total = np.array([tangential * np.tan(stage.working_pressure_angle), tangential,
                      tangential * np.tan(case.gears[0].geometry.helix_angle)])  # fmt: skip
    shafts = np.array([bearing.shaft == "A" for bearing in case.bearings])
    told = force.accuracy.parted_error or 0.0
    for at in (shafts, ~shafts):
        off = float(np.abs(np.abs(mean[at].sum(axis=0)) - np.abs(total)).max())
        assert off < 1e-4 * np.abs(total).max() + (1e-5 + 5 * told) * most
    velocity, points = result.surface_velocity, pressure.points
    line = int(np.abs(pressure.pressure[:, 0]).argmax())
    alone = SurfaceVelocity(velocity.frequency[[line]], velocity.normal_velocity[[line]], velocity.surface)
    direct = solve_direct(alone, points, air=case.air, fidelity=knobs.acoustics).pressure[0]
    band = result.error_band
    assert bool((band.lower <= band.upper).all())
    if knobs.acoustics.radiation == "boundary_elements":
        error = float(np.abs(pressure.pressure[line] - direct).max() / np.abs(direct).max())
        assert error < 0.12  # 1 dB
    assert float(band.lower[line, 0]) <= float(decibel(direct)[0]) <= float(band.upper[line, 0])


WILD = st.sampled_from([None] * 5 + ["helix", "damping", "speed", "torque", "point"])


@pytest.mark.slow
@given(st.data())
@settings(max_examples=MANY or 5)
def test_any_gearbox_of_any_size_sounds_as_it_must_or_is_refused(tried, case, data):
    """Every drawing at two sizes: as far as it is linear elasticity, Hertz and sound, the answers are the same."""
    wild = data.draw(WILD, label="wild")
    s = data.draw(powers(0.05, 20.0), label="scale")
    radiation = data.draw(st.sampled_from(["boundary_elements", "rayleigh", "equivalent_radiated_power"]))
    knobs = replace(COARSE, acoustics=replace(COARSE.acoustics, radiation=radiation))
    one = tried(drawn, data, case, wild)
    two = None if one is None else tried(scaled, one, knobs, s)
    if two is None:
        return
    results = []
    for asked, its, size in ((one, knobs, 1.0), (*two, s)):
        result = tried(nvh.run, asked, fidelity=its, housing=egg_housing(asked, size))
        if result is not None:
            check(asked, result, its)
            results.append(result.pressure.pressure)
    if len(results) == 2:
        apart = float(np.abs(results[1] - results[0]).max() / np.abs(results[0]).max())
        assert apart < 1e-3


@pytest.mark.slow
@given(st.data())
@settings(max_examples=MANY // 10 or 1)
@pytest.mark.filterwarnings("ignore:the parts of the motion cancel")
def test_any_gearbox_in_its_casting_with_elements_in_its_gears_is_right_or_refused(tried, case, data):
    """Gears and housing are meshed and solved anew for every case."""
    knobs = replace(COARSE, gear=replace(COARSE.gear, bodies="elements"))
    asked = tried(drawn, data, case, None)
    s = data.draw(powers(0.3, 3.0), label="scale")
    two = None if asked is None else tried(scaled, asked, knobs, s)
    result = None if two is None else tried(nvh.run, two[0], fidelity=two[1])
    if result is not None:
        check(*two[:1], result, two[1])
