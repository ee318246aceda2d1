"""A case gets what it asks for, and nothing is computed that only other quantities need."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain import acoustics, levels
from nvhchain.cli import main
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.files import hdf5
from nvhchain.handoff import (
    Directivity,
    ForceSpectrum,
    RadiationEfficiency,
    RadiationResistance,
    SoundPower,
    SurfaceVelocity,
)
from nvhchain.report import compare

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose


@pytest.fixture
def asked(cases, coarse, compared, record):
    """Run the solid gearbox for `quantities` on the operators of the comparison; the stages that were touched."""

    def run(*quantities, **changes):
        case = replace(cases[0], quantities=quantities, **changes)
        result = nvh.run(case, fidelity=coarse, operators=compared[0] / "operators", watcher=record)
        return result, [stage for stage, _ in record.ended]

    return run


def test_bearing_forces_alone_move_no_surface_and_need_no_field_point(asked, compared):
    result, stages = asked("bearing_forces", field_points=())
    assert stages == ["housing", "mesh_law_stage1", "mesh_law_stage2", "bearing_forces", "force_spectrum"]
    assert result.surface_velocity is result.transfer_vectors is result.pressure is None
    compared_forces = hdf5.load(compared[0] / "solid" / "force_spectrum.h5", ForceSpectrum)
    assert result.force_spectrum.content_hash == compared_forces.content_hash
    band = result.error_bands["bearing_forces"]
    assert set(band.sources) == {"gear", "time step", "settling", "housing", "excluded modes"}
    assert (band.overall[:, 0] < band.level).all()
    assert (band.level < band.overall[:, 1]).all()


def test_surface_velocity_alone_takes_no_boundary_elements(asked, compared):
    result, stages = asked("surface_velocity", field_points=())
    assert stages[-1] == "surface_velocity"
    assert "transfer_vectors" not in stages
    velocity = hdf5.load(compared[0] / "solid" / "surface_velocity.h5", SurfaceVelocity)
    assert result.surface_velocity.content_hash == velocity.content_hash


@pytest.mark.slow
def test_sound_power_of_the_gearbox_is_that_of_its_velocity_and_takes_no_field_point(asked, coarse, compared):
    """Through the modes' radiation resistance between masters, against solutions at the five loudest lines: the masters
    are chosen for 1 dB here, 0.3 dB are kept."""
    result, stages = asked("sound_power", field_points=())
    assert stages[-2:] == ["radiation_resistance", "sound_power"]
    assert not {"transfer_vectors", "surface_velocity"}.intersection(stages)
    power = result.sound_power
    loudest = np.sort(np.argsort(power.power)[-5:])
    velocity = hdf5.load(compared[0] / "solid" / "surface_velocity.h5", SurfaceVelocity)
    lines = np.searchsorted(velocity.frequency, power.frequency[loudest] - 1e-6)
    some = velocity.replace(frequency=velocity.frequency[lines], normal_velocity=velocity.normal_velocity[lines])
    solved = acoustics.sound_power(some, fidelity=coarse.acoustics)
    assert np.abs(10 * np.log10(power.power[loudest] / solved.power)).max() < 0.3
    assert power.input_speed == result.force_spectrum.input_speed


def test_radiation_resistance_leaves_out_bearings_without_load(cases, coarse, compared, tmp_path):
    forces = hdf5.load(compared[0] / "solid" / "force_spectrum.h5", ForceSpectrum)
    (path,) = (compared[0] / "operators").glob("housing-*.h5")
    force, some = forces.force.copy(), forces.frequency < 300.0
    force[:, 0] = 0.0
    idle = forces.replace(frequency=forces.frequency[some], force=force[some])
    case = replace(cases[0], quantities=("sound_power",), field_points=(), band=replace(cases[0].band, high=300.0))
    result = nvh.run(case, fidelity=coarse, force_spectrum=idle, housing=hdf5.load(path), out=tmp_path)
    (path,) = tmp_path.glob("radiation_resistance-*.h5")
    moving = hdf5.load(path, RadiationResistance).plane_wave_resistance.diagonal() > 0
    loaded = idle.sort_bearings(result.housing.names).any(axis=0)
    assert not loaded[3 * result.housing.names.index(forces.names[0])]
    assert moving[len(moving) - len(loaded) :].tolist() == loaded.tolist()
    band = result.error_bands["sound_power"]  # of a housing and forces that were given: by the sound alone
    assert {"surface mesh", "masters"} <= set(band.sources) <= {"surface mesh", "masters", "quadrature", "cancellation"}
    assert (band.lower[:, 0] < levels.power_level(result.sound_power.power)).all()


def test_sound_power_of_the_pulsating_sphere(request, tmp_path, capsys):
    """½ ρc v² 4πa² (ka)²/(1 + (ka)²) at the three frequencies of the case, energies added with A-weighting."""
    path = tmp_path / "case.toml"
    path.write_text(
        f'base = "{request.config.rootpath}/cases/sphere/pulsating.toml"\n'
        'quantities = ["sound_power"]\nfield_points = []\n'
    )
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    frequency = np.array([200.0, 1000.0, 1715.0])
    ka = 2 * np.pi * frequency / 343.0 * 0.1
    exact = 0.5 * 1.21 * 343.0 * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2)
    found = hdf5.load(tmp_path / "out" / "sound_power.h5", SoundPower)
    np.testing.assert_allclose(found.power, exact, rtol=0.02)  # the polyhedron of 1280 faces is 1 % smaller
    assert f"sound power {levels.overall_power(frequency, found.power):.1f} dB(A)" in capsys.readouterr().out
    assert levels.power_level(1e-12) == 0
    weights = levels.a_weighting(frequency)
    whole = 10 * np.log10((exact * 10 ** (weights / 10)).sum() / 1e-12)
    assert abs(levels.overall_power(frequency, exact) - whole) < 1e-12
    assert main(["plot", str(tmp_path / "out" / "sound_power.h5")]) == 0
    assert (tmp_path / "out" / "sound_power.png").stat().st_size > 10_000


def test_efficiency_and_directivity_of_spheres(request, tmp_path, capsys):
    """(ka)²/(1 + (ka)²) of the pulsating sphere; 3 cos² θ of the oscillating one, 10 m away."""
    sphere = request.config.rootpath / "cases/sphere/pulsating.toml"
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(f'base = "{sphere}"\nquantities = ["radiation_efficiency"]\nfield_points = []\n')
    assert main(["run", str(path), "--out", str(out)]) == 0
    found = hdf5.load(out / "radiation_efficiency.h5", RadiationEfficiency)
    ka = 2 * np.pi * np.array([200.0, 1000.0, 1715.0]) / 343.0 * 0.1
    np.testing.assert_allclose(found.efficiency, ka**2 / (1 + ka**2), rtol=0.02)
    told = capsys.readouterr().out
    assert f"radiation efficiency {found.efficiency.min():.3g}…{found.efficiency.max():.3g}" in told
    assert "sound power" in told  # with its limits: that of which the efficiency is a share
    (power,) = json.loads((out / "error_bands.json").read_text()).values()
    exact = 10 * np.log10(0.5 * 1.21 * 343.0 * 4 * np.pi * 0.1**2 * ka**2 / (1 + ka**2) / 1e-12)
    for level, line in zip(exact, power["lines"], strict=True):
        assert line["limits"][0][0] < level < line["limits"][0][1]
    assert main(["plot", str(out / "radiation_efficiency.h5")]) == 0
    path.write_text(
        f'base = "{sphere}"\nquantities = ["directivity"]\npulsation = 0.0\nvelocity = [0.0, 0.0, 0.1]\n'
        "frequencies = [200.0, 400.0]\n"
        '[[field_points]]\nname = "ahead"\nposition = [0.0, 0.0, 10.0]\n'
        '[[field_points]]\nname = "aslant"\nposition = [0.0, 8.0, 6.0]\n'
    )
    assert main(["run", str(path), "--fidelity", "draft", "--out", str(out)]) == 0
    index = hdf5.load(out / "directivity.h5", Directivity)
    named = [point.name for point in nvh.load_case(path).field_points]
    at = [named.index("ahead"), named.index("aslant")]
    level = 10 * np.log10([3.0, 3.0 * 0.36])
    np.testing.assert_allclose(index.index[:, at], [level, level], atol=0.1)
    assert f"{level[1]:.1f} dB at aslant" in capsys.readouterr().out
    assert set(json.loads((out / "error_bands.json").read_text())) == {"pressure", "sound_power"}
    assert not (out / "radiation_efficiency.h5").exists()  # of the other case
    assert main(["plot", str(out / "directivity.h5")]) == 0
    for name in ("radiation_efficiency", "directivity"):
        assert (out / f"{name}.png").stat().st_size > 10_000


def test_efficiency_of_the_gearbox_is_that_of_its_velocity(asked, compared):
    """From the housing's modes, without the velocity of its surface."""
    result, stages = asked("radiation_efficiency", field_points=())
    assert stages[-3:] == ["radiation_resistance", "sound_power", "radiation_efficiency"]
    assert not {"transfer_vectors", "surface_velocity"}.intersection(stages)
    velocity = hdf5.load(compared[0] / "solid" / "surface_velocity.h5", SurfaceVelocity)
    exact = acoustics.surface_efficiency(result.sound_power, velocity, result.case.air)
    np.testing.assert_allclose(result.radiation_efficiency.frequency, exact.frequency)
    np.testing.assert_allclose(result.radiation_efficiency.efficiency, exact.efficiency, rtol=1e-6)


def test_directivity_of_the_gearbox_compares_its_pressure_with_its_power(asked):
    with pytest.warns(AccuracyWarning, match="field point 0 is"):  # 1 m away at 50 Hz
        result, stages = asked("directivity")
    assert {"transfer_vectors", "radiation_resistance", "pressure", "sound_power"} <= {*stages}
    vertices = result.surface_velocity.surface.vertices
    r = np.linalg.norm(result.directivity.points - 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)), axis=1)
    even = result.sound_power.power[:, None] * result.case.air.impedance / (2 * np.pi * r**2)
    np.testing.assert_allclose(
        result.directivity.index, 10 * np.log10(np.abs(result.pressure.pressure) ** 2 / even), atol=1e-6
    )


@pytest.mark.parametrize("radiation", ["rayleigh", "equivalent_radiated_power"])
@pytest.mark.parametrize("quantity", ["radiation_efficiency", "directivity"])
def test_levels_that_know_no_efficiency_are_refused_before_any_work(cases, coarse, record, radiation, quantity):
    cheap = replace(coarse, acoustics=replace(coarse.acoustics, radiation=radiation))
    with pytest.raises(InputError, match="choose radiation = boundary_elements"):
        nvh.run(replace(cases[0], quantities=(quantity,)), fidelity=cheap, watcher=record)
    assert record.began == []


@pytest.mark.slow
def test_plan_leaves_out_what_is_not_asked_for(cases, coarse):
    plans = {
        quantity: [step.name for step in nvh.plan(replace(cases[0], quantities=(quantity,)), fidelity=coarse).steps]
        for quantity in ("bearing_forces", "surface_velocity", "pressure", "sound_power", "directivity")
    }
    assert plans["bearing_forces"] == ["housing", "mesh law stage1", "mesh law stage2", "bearing forces"]
    assert plans["surface_velocity"] == [*plans["bearing_forces"], "velocity"]
    assert plans["sound_power"] == [*plans["bearing_forces"], "radiation resistance"]
    assert plans["directivity"] == [*plans["pressure"], "radiation resistance"]
    assert plans["pressure"] == [*plans["bearing_forces"], "transfer vectors", "velocity, pressure"]


def test_quantities_that_cannot_be_had_are_refused(request, cases, coarse, tmp_path):
    case = cases[0]
    ramp = replace(
        case.operation, ramp=nvh.load_case(request.config.rootpath / "cases/gearbox/run_up_solid.toml").operation.ramp
    )
    for changes, reason in (
        ({"quantities": ()}, "at least one"),
        ({"quantities": ("pressure", "pressure")}, "none twice"),
        ({"field_points": ()}, "asked for nowhere"),
        ({"quantities": ("surface_velocity",), "operation": ramp}, "have no lines"),
        ({"quantities": ("directivity",), "operation": ramp}, "have no lines"),
        ({"quantities": ("directivity",), "field_points": ()}, "asked for nowhere"),
    ):
        with pytest.raises(InputError, match=reason):
            replace(case, **changes)
    with pytest.raises(InputError, match="does not ask for `pressure`"):
        compare([replace(case, quantities=("bearing_forces",))], fidelity=coarse, out=tmp_path)


def test_sound_power_of_a_level_without_surface_pressure_is_refused_before_any_work(cases, coarse, record):
    rayleigh = replace(coarse, acoustics=replace(coarse.acoustics, radiation="rayleigh"))
    with pytest.raises(InputError, match="has no pressure on the surface"):
        nvh.run(replace(cases[0], quantities=("sound_power",)), fidelity=rayleigh, watcher=record)
    assert record.began == []


def test_plan_of_a_radiators_sound_power_counts_its_lines(request):
    case = nvh.load_case(request.config.rootpath / "cases/sphere/pulsating.toml")
    lines = tuple(float(f) for f in range(100, 500))
    plan = nvh.plan(replace(case, quantities=("sound_power",), frequencies=lines))
    assert "400 lines" in str(plan)


def test_command_line_says_where_the_quantities_are(request, tmp_path, capsys):
    sphere = request.config.rootpath / "cases/sphere/pulsating.toml"
    path = tmp_path / "case.toml"
    path.write_text(f'base = "{sphere}"\nquantities = ["surface_velocity"]\n')
    assert main(["run", str(path), "--fidelity", "draft", "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "surface_velocity in" in told
    # a pulsation of 1 m/s on every face at three lines, given as it is
    level = 20 * np.log10(1.0 / 2**0.5 / 1e-9) + 10 * np.log10(3)
    assert f"surface velocity {level:.1f} dB re 1 nm/s (95 % limits {level:.1f}…{level:.1f})" in told
    assert hdf5.load(tmp_path / "out" / "surface_velocity.h5", SurfaceVelocity).frequency.tolist() == [200, 1000, 1715]
    path.write_text(f'base = "{sphere}"\nquantities = ["loudness"]\n')
    assert main(["check", str(path)]) == 2
    assert "choose one of" in capsys.readouterr().err
