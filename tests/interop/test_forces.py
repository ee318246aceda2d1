"""Foreign bearing forces: round trips, units, sign, axes, sampling, and a clear refusal of everything doubtful."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
import pyuff
from scipy.io import loadmat, savemat

from nvhchain._table import build
from nvhchain.errors import InputError
from nvhchain.handoff import BearingForces
from nvhchain.interop import (
    BearingChannels,
    ForceChannels,
    read_bearing_forces,
    read_record,
    records,
    write_bearing_forces,
)
from nvhchain.interop.channel_units import unit_called
from nvhchain.interop.sampling import resampled
from nvhchain.store import save

RATE = 25e3
POSITIONS = {"A": (0.0, 0.0, 0.01), "B": (0.05, -0.02, 0.13)}


@pytest.fixture
def forces():
    rng = np.random.default_rng(5)
    time = np.arange(500) / RATE
    return BearingForces(
        time=time,
        force=1e3 * rng.standard_normal((500, 2, 3)),
        names=("A", "B"),
        positions=np.array(list(POSITIONS.values())),
        input_speed=260.0 + time,
        periodic=True,
    )


@pytest.fixture
def declared():
    return ForceChannels(
        (BearingChannels("A", "Ax", "Ay", "Az"), BearingChannels("B", "Bx", "By", "Bz")),
        force_unit="N", acts_on="housing", speed=260.0, time_channel="t",
    )  # fmt: skip


def csv(path, time, columns, *, header="t,Ax,Ay,Az,Bx,By,Bz", units=None):
    rows = [header] + ([units] if units else [])
    rows += [",".join(repr(float(v)) for v in row) for row in np.column_stack([time, columns])]
    path.write_text("\n".join(rows))
    return path


def six_tones(time, frequency=300.0):
    return np.stack([np.sin(2 * np.pi * frequency * time + k) for k in range(6)], axis=1)


SUFFIXES = pytest.mark.parametrize("suffix", [".csv", ".mat", ".h5", ".uff"])


@SUFFIXES
def test_written_forces_read_back_bit_for_bit(forces, tmp_path, suffix):
    path = tmp_path / f"forces{suffix}"
    back = read_bearing_forces(path, write_bearing_forces(forces, path))
    assert back.force.tobytes() == forces.force.tobytes()
    assert back.input_speed.tobytes() == forces.input_speed.tobytes()
    assert back.names == forces.names
    assert back.positions.tobytes() == forces.positions.tobytes()
    assert back.periodic
    np.testing.assert_allclose(back.time, forces.time, rtol=0, atol=1e-12)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@SUFFIXES
@pytest.mark.parametrize("meshes", [1, 2])
def test_errors_of_the_meshes_go_along_bit_for_bit(forces, tmp_path, suffix, meshes):
    rng = np.random.default_rng(6)
    whole = forces.replace(
        mesh_deflection=1e-5 * rng.standard_normal((500, meshes)),
        transmission_error=1e-5 * rng.standard_normal((500, meshes)),
        output_lag=1e-4 * rng.standard_normal(500),
    )
    path = tmp_path / f"forces{suffix}"
    channels = write_bearing_forces(whole, path)
    back = read_bearing_forces(path, channels)
    for quantity in ("force", "mesh_deflection", "transmission_error", "output_lag"):
        assert back.recorded(quantity).tobytes() == whole.recorded(quantity).tobytes(), quantity
    named = [*channels.mesh_deflection, *channels.transmission_error, channels.output_lag]
    assert [read_record(path).units[name] for name in named] == ["m"] * 2 * meshes + ["rad"]
    for change, message in (({"length_unit": "um"}, "is in 'm' by the file"), ({"angle_unit": "deg"}, "is in 'rad'")):
        with pytest.raises(InputError, match=message):
            read_bearing_forces(path, replace(channels, **change))


def test_foreign_errors_are_converted_and_resampled_with_the_forces(tmp_path, declared):
    time = np.arange(4000) / 20e3
    tone = np.sin(2 * np.pi * 300.0 * time)
    path = csv(
        tmp_path / "a.csv", time, np.column_stack([six_tones(time), 7.0 * tone, 2.0 * tone]),
        header="t,Ax,Ay,Az,Bx,By,Bz,te,lag",
    )  # fmt: skip
    channels = replace(declared, transmission_error=("te",), output_lag="lag", length_unit="um", angle_unit="deg")
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    np.testing.assert_allclose(found.transmission_error[:, 0], 7e-6 * tone, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(found.output_lag, np.deg2rad(2.0) * tone, rtol=1e-12, atol=1e-16)
    slower = read_bearing_forces(path, replace(channels, resample_rate=5e3), positions=POSITIONS)
    middle = slice(40, -40)
    expected = np.sin(2 * np.pi * 300.0 * slower.time)[middle]
    assert np.abs(slower.transmission_error[middle, 0] - 7e-6 * expected).max() < 7e-9
    assert np.abs(slower.output_lag[middle] - np.deg2rad(2.0) * expected).max() < 4e-5
    assert np.abs(slower.force[middle, 0, 0] - expected).max() < 1e-3


def test_errors_that_do_not_fit_the_record_are_refused(tmp_path, declared):
    savemat(tmp_path / "a.mat", {n: np.zeros(50) for n in ("Ax", "Ay", "Az", "Bx", "By", "Bz")}
            | {"t": np.arange(50) * 1e-3, "te": np.zeros(49)})  # fmt: skip
    with pytest.raises(InputError, match="transmission_error 'te' has 49 samples, the forces 50"):
        read_bearing_forces(tmp_path / "a.mat", replace(declared, transmission_error=("te",)), positions=POSITIONS)
    with pytest.raises(InputError, match="different numbers of meshes"):
        replace(declared, transmission_error=("a", "b"), mesh_deflection=("c",))
    with pytest.raises(InputError, match="length_unit = 'inch' is unknown"):
        replace(declared, length_unit="inch")


def test_stored_hand_off_and_matlab_73_file_are_read_as_hdf5(forces, tmp_path, declared):
    stored = save(forces, tmp_path / "forces.h5")
    names = [f"force[{i},{k}]" for i in range(2) for k in range(3)]
    channels = replace(
        declared,
        bearings=(BearingChannels("A", *names[:3]), BearingChannels("B", *names[3:])),
        time_channel="time",
        speed=None,
        speed_channel="input_speed",
    )
    np.testing.assert_array_equal(read_bearing_forces(stored, channels, positions=POSITIONS).force, forces.force)
    matlab = tmp_path / "v73.mat"
    matlab.write_bytes(stored.read_bytes())
    np.testing.assert_array_equal(read_bearing_forces(matlab, channels, positions=POSITIONS).force, forces.force)


def test_units_sign_and_axes_are_taken_as_declared(tmp_path, declared):
    time = np.arange(100) * 1e-3
    values = np.tile([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (100, 1))
    path = csv(tmp_path / "a.csv", 1e3 * time, values)
    # the record's x is the gearbox's z, its y the gearbox's x
    turned = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    channels = replace(declared, force_unit="kN", acts_on="shaft", time_unit="ms", rotation=turned)
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    np.testing.assert_allclose(found.force[0], [[-2e3, -3e3, -1e3], [-5e3, -6e3, -4e3]])
    np.testing.assert_allclose(found.time, time)
    np.testing.assert_array_equal(found.input_speed, 260.0)
    pounds = read_bearing_forces(path, replace(channels, force_unit="lbf"), positions=POSITIONS)
    np.testing.assert_allclose(pounds.force / found.force, 4.4482216152605e-3)


def test_speed_channel_is_converted_and_sample_rate_replaces_a_time_channel(tmp_path, declared):
    time = np.arange(100) / 10e3
    values = np.column_stack([six_tones(time), np.full(100, 2500.0)])
    path = csv(tmp_path / "a.csv", time, values, header="t,Ax,Ay,Az,Bx,By,Bz,n")
    channels = replace(declared, speed=None, speed_channel="n", speed_unit="rpm", time_channel=None, sample_rate=10e3)
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    np.testing.assert_allclose(found.input_speed, 2500 * 2 * np.pi / 60)
    assert found.sample_rate == pytest.approx(10e3, rel=1e-12)


def test_order_of_bearings_is_the_declared_one_and_positions_match_by_name(tmp_path, declared):
    time = np.arange(100) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time))
    swapped = replace(declared, bearings=declared.bearings[::-1])
    found = read_bearing_forces(path, swapped, positions={**POSITIONS, "C": (9.0, 9.0, 9.0)})
    assert found.names == ("B", "A")
    np.testing.assert_array_equal(found.positions, [POSITIONS["B"], POSITIONS["A"]])
    own = BearingChannels("A", "Ax", "Ay", "Az", position=(1.0, 2.0, 3.0))
    found = read_bearing_forces(path, replace(declared, bearings=(own,)), positions=POSITIONS)
    np.testing.assert_array_equal(found.positions, [[1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match="position_mm"):
        read_bearing_forces(path, declared, positions={**POSITIONS, "A": (120.0, 30.0, 85.0)})


def test_units_in_the_file_must_agree_with_the_declared_ones(tmp_path, declared):
    time = np.arange(100) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time), units="s,N,N,N,N,kN,N")
    with pytest.raises(InputError, match=r"'By' is in 'kN' by the file, but 'N' is declared"):
        read_bearing_forces(path, declared, positions=POSITIONS)
    path = csv(tmp_path / "b.csv", time, six_tones(time), units="ms,N,N,N,N,N,N")
    with pytest.raises(InputError, match=r"'t' is in 'ms' by the file, but 's' is declared"):
        read_bearing_forces(path, declared, positions=POSITIONS)


def test_gaps_jitter_and_repeated_times_are_refused_with_place_and_remedy(tmp_path, declared):
    time = np.arange(400) / 10e3

    def read(at, keep=slice(None)):
        return read_bearing_forces(
            csv(tmp_path / "a.csv", at[keep], six_tones(at)[keep]), declared, positions=POSITIONS
        )

    with pytest.raises(
        InputError, match=r"gap of 0\.0006 s after t = 0\.0149 s .*cut the record there or give resample"
    ):
        read(time, np.r_[0:150, 155:400])
    with pytest.raises(InputError, match=r"steps differ by up to .* % from their mean of .* s: give resample_rate"):
        read(np.round(time + 2e-6 * np.sin(np.arange(400)), 9))
    with pytest.raises(InputError, match=r"time goes .* after sample 7: it must increase strictly"):
        read(np.where(np.arange(400) == 8, time[7], time))


def test_jittered_record_is_resampled_without_aliases(tmp_path, declared):
    rng = np.random.default_rng(1)
    time = np.arange(4000) / 20e3 + 8e-6 * rng.uniform(-1, 1, 4000)
    inside, folding = 1500.0, 3700.0  # 3700 Hz would fold to 1300 Hz at 5000 Hz
    values = six_tones(time, inside) + six_tones(time, folding)
    path = csv(tmp_path / "a.csv", time, values)
    found = read_bearing_forces(path, replace(declared, resample_rate=5e3), positions=POSITIONS)
    assert found.sample_rate == pytest.approx(5e3, rel=1e-12)
    expected = six_tones(found.time, inside).reshape(-1, 2, 3)
    middle = slice(40, -40)  # away from the transient of the filter
    assert np.abs(found.force - expected)[middle].max() < 1e-3
    assert found.provenance["resampled"] == 5e3


def test_resampling_keeps_constants_and_carries_no_faster_than_the_record(tmp_path, declared):
    time = np.delete(np.arange(400) / 10e3, [150, 151])
    path = csv(tmp_path / "a.csv", time, np.full((398, 6), 7.0))
    found = read_bearing_forces(path, replace(declared, resample_rate=2e3), positions=POSITIONS)
    np.testing.assert_allclose(found.force, 7.0, rtol=1e-9)
    with pytest.raises(InputError, match=r"0\.0003 s without a sample .* lower it to 3333 Hz"):
        read_bearing_forces(path, replace(declared, resample_rate=5e3), positions=POSITIONS)


def test_a_rate_that_leaves_fewer_than_eight_samples_is_refused_at_once(tmp_path, declared):
    time = np.arange(400) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time))
    for rate in (1e-9, 100.0, 175.0):
        with pytest.raises(InputError, match=r"resample_rate = .* Hz leaves \d samples of 0\.0399 s, but 8 are needed"):
            read_bearing_forces(path, replace(declared, resample_rate=rate), positions=POSITIONS)
    assert len(read_bearing_forces(path, replace(declared, resample_rate=200.0), positions=POSITIONS).time) == 8


def test_a_speed_channel_that_turns_back_is_refused_as_a_constant_is(tmp_path, declared):
    time = np.arange(100) / 10e3
    header = "t,Ax,Ay,Az,Bx,By,Bz,n"
    channels = replace(declared, speed=None, speed_channel="n")
    for speed in (np.full(100, -10.0), np.linspace(10.0, -10.0, 100)):
        path = csv(tmp_path / "a.csv", time, np.column_stack([six_tones(time), speed]), header=header)
        with pytest.raises(InputError, match=r"speed channel 'n' is -10 rad/s in sample \d+, but 0 or more is needed"):
            read_bearing_forces(path, channels, positions=POSITIONS)
    path = csv(tmp_path / "a.csv", time, np.column_stack([six_tones(time), np.linspace(0, 10, 100)]), header=header)
    found = read_bearing_forces(path, channels, positions=POSITIONS)
    with pytest.raises(InputError, match=r"the folder .*nowhere does not exist"):
        write_bearing_forces(found, tmp_path / "nowhere" / "a.csv")


@pytest.mark.parametrize(("tone", "gap", "rate"), [(833.0, 2e-3, 400.0), (2500.0, 4e-3, 240.0)])
def test_a_gap_invents_no_forces(tone, gap, rate):
    """200 N around 1000 N far above the new band: what comes out stays within that, and is right beside the gap."""
    time = np.arange(5000) / 25e3
    force = 1000.0 + 200.0 * np.sin(2 * np.pi * tone * time)
    kept = (time < 0.1) | (time > 0.1 + gap - 4.1e-5)
    at, found = resampled(time[kept], force[kept], rate, "record")
    _, wanted = resampled(time, force, rate, "record")
    assert np.abs(found - 1000.0).max() < 200.0
    far = np.abs(at - 0.1) * rate > 12
    assert np.abs(found - wanted)[far].max() < 0.05


def test_a_gap_in_a_slow_tone_is_bridged_along_it():
    time = np.arange(5000) / 25e3
    force = 1000.0 + 200.0 * np.sin(2 * np.pi * 100.0 * time)
    kept = (time < 0.1) | (time > 0.102)
    at, found = resampled(time[kept], force[kept], 400.0, "record")
    inner = (at > 0.03) & (at < 0.17)
    assert np.abs(found - 1000.0 - 200.0 * np.sin(2 * np.pi * 100.0 * at))[inner].max() < 3.0


@pytest.mark.parametrize("level", ["5", "7.3"])
def test_units_in_a_matlab_file_must_agree(forces, tmp_path, level):
    path = tmp_path / "a.mat"
    channels = write_bearing_forces(forces, path)
    assert read_record(path).units["force[1,2]"] == "N"
    if level == "7.3":
        path.unlink()
        with h5py.File(path, "w") as file:
            for name, unit in (("time", "s"), ("input_speed", "rad/s"), ("force", "N")):
                file[name] = getattr(forces, name).T  # as MATLAB stores its axes
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
                file[f"units/{name}"] = np.array([[ord(c)] for c in unit], dtype=np.uint16)
                file[f"units/{name}"].attrs["MATLAB_class"] = np.bytes_("char")
        assert list(read_record(path).units) == list(read_record(path).channels)
    assert read_bearing_forces(path, channels).force.tobytes() == forces.force.tobytes()
    for change, message in (
        ({"force_unit": "kN"}, r"'force\[0,0\]' is in 'N' by the file, but 'kN' is declared"),
        ({"speed_unit": "rpm"}, "'input_speed' is in 'rad/s' by the file"),
        ({"time_unit": "ms"}, "'time' is in 's' by the file"),
    ):
        with pytest.raises(InputError, match=message):
            read_bearing_forces(path, replace(channels, **change))


def test_units_of_a_nested_matlab_structure_belong_to_the_fields_beside_them(tmp_path):
    wave = np.sin(np.arange(50.0))
    savemat(tmp_path / "run.mat", {"run": {"left": wave, "right": wave, "units": {"left": "kN", "right": ""}}})
    assert read_record(tmp_path / "run.mat").units == {"run.left": "kN"}


@pytest.mark.parametrize(("code", "unit"), [(1, "N"), (4, "pdl"), (10, "N")])
def test_uff_system_of_units_names_the_force(forces, tmp_path, code, unit):
    path = tmp_path / "a.uff"
    channels = write_bearing_forces(forces, path)
    kept = [dict(s) for s in pyuff.UFF(str(path)).read_sets()]
    for each in kept:
        each["ordinate_axis_units_lab"] = "NONE"
    other = tmp_path / "b.uff"
    system = pyuff.prepare_164(1, "units", 2, 1.0, 1.0, 1.0, 0.0) | {"units_code": code}
    pyuff.UFF(str(other)).write_sets([system, *kept], mode="add")
    assert read_record(other).units["1:x"] == unit
    pyuff.UFF(str(other)).write_sets([system | {"units_code": 5}], mode="add")
    with pytest.raises(InputError, match=f"'1:x' is in '{unit}, mN' by the file"):
        read_bearing_forces(other, channels)


def test_uff_axes_units_and_directions_follow_the_format(forces, tmp_path):
    path = tmp_path / "a.uff"
    channels = write_bearing_forces(forces, path)

    def rewrite(change):
        other = tmp_path / "b.uff"
        other.unlink(missing_ok=True)
        kept = [dict(s) for s in pyuff.UFF(str(path)).read_sets()]
        change(kept)
        pyuff.UFF(str(other)).write_sets(kept, mode="add")
        return other

    flipped = read_bearing_forces(rewrite(lambda s: s[1].update(rsp_dir=-1)), channels)
    np.testing.assert_array_equal(flipped.force[:, 0, 0], -forces.force[:, 0, 0])
    for change, message in (
        (lambda s: s[2].update(ordinate_axis_units_lab="kN"), "'1:y' is in 'kN' by the file"),
        (lambda s: s[2].update(ordinate_spec_data_type=12), "1:y holds no force"),
        (lambda s: s[2].update(rsp_dir=4), r"no channel '1:y'; it has 0:scalar, 1:x, 1:rx"),
        (lambda s: s[2].update(rsp_dir=7), "direction 7 is none of dataset 58"),
        (lambda s: s[2].update(rsp_dir=1), "1:x has two time responses: keep one"),
        (lambda s: s[2].update(abscissa_axis_units_lab="ms"), "1:y has its time in 'ms': s is needed"),
        (lambda s: s[2].update(x=s[2]["x"] + 1e-6), "1:y has another time axis than 1:x"),
        (lambda s: s[2].update(func_type=4), r"no channel '1:y'"),
    ):
        with pytest.raises(InputError, match=message):
            read_bearing_forces(rewrite(change), channels)
    moments = replace(channels, bearings=(replace(channels.bearings[0], y="1:rx"),))
    with pytest.raises(InputError, match="1:rx is a rotation: forces are needed, not moments"):
        read_bearing_forces(rewrite(lambda s: s[2].update(rsp_dir=4)), moments)
    with pytest.raises(InputError, match=r"sampled at 25000 Hz by its own time axis"):
        read_bearing_forces(path, replace(channels, sample_rate=24e3))


@pytest.mark.parametrize("time", ["S", "SEC", "Seconds", "s"])
def test_uff_labels_may_be_spelled_out_and_undeclared_channels_may_be_anything(forces, tmp_path, time):
    path = tmp_path / "a.uff"
    channels = write_bearing_forces(forces, path)
    kept = [dict(s) for s in pyuff.UFF(str(path)).read_sets()]
    for each in kept:
        each.update(abscissa_axis_units_lab=time)
    for each in kept[1:]:
        each.update(ordinate_axis_units_lab="NEWTONS")
    acceleration = kept[1] | {"rsp_node": 77, "ordinate_spec_data_type": 12, "ordinate_axis_units_lab": "m/s^2"}
    acceleration |= {"x": kept[1]["x"][:50] * 2, "data": kept[1]["data"][:50]}
    moment = kept[1] | {"rsp_dir": 5, "ordinate_axis_units_lab": "Nm"}
    pyuff.UFF(str(tmp_path / "b.uff")).write_sets([acceleration, *kept, moment, moment], mode="add")
    assert read_bearing_forces(tmp_path / "b.uff", channels).force.tobytes() == forces.force.tobytes()
    with pytest.raises(InputError, match="77:x holds no force"):
        read_bearing_forces(tmp_path / "b.uff", replace(channels, transmission_error=("77:x",)))


def test_a_uff_gap_of_half_a_step_is_told_remedies_it_has(forces, tmp_path):
    path = tmp_path / "a.uff"
    channels = replace(write_bearing_forces(forces, path), sample_rate=None)
    kept = [dict(s) for s in pyuff.UFF(str(path)).read_sets()]
    for each in kept:
        # dataset 58 keeps 6 digits of every time
        each.update(abscissa_spacing=0, x=np.arange(500) * 1e-3 + np.where(np.arange(500) < 250, 0.0, 0.5e-3))
    pyuff.UFF(str(tmp_path / "b.uff")).write_sets(kept, mode="add")
    with pytest.raises(InputError, match="give resample_rate, or sample_rate and no time_channel if the clock was"):
        read_bearing_forces(tmp_path / "b.uff", channels)
    assert read_bearing_forces(
        tmp_path / "b.uff", replace(channels, resample_rate=300.0, periodic=False)
    ).sample_rate == pytest.approx(300.0)


def test_uff_is_written_as_pyuff_writes_it(forces, tmp_path):
    odd = forces.replace(names=("A" * 90, 'Läger, "轴"\nz'), output_lag=np.zeros(500), time=forces.time + 12.3456)
    write_bearing_forces(odd, tmp_path / "a.uff")
    sets = [dict(s) for s in pyuff.UFF(str(tmp_path / "a.uff")).read_sets()]
    assert len(sets) == 8
    pyuff.UFF(str(tmp_path / "b.uff")).write_sets(sets, mode="add")
    assert (tmp_path / "a.uff").read_bytes() == (tmp_path / "b.uff").read_bytes()


def test_uff_without_stated_rate_uses_its_own_axis(forces, tmp_path):
    path = tmp_path / "a.uff"
    channels = replace(write_bearing_forces(forces, path), sample_rate=None)
    assert read_bearing_forces(path, channels).sample_rate == pytest.approx(RATE, rel=1e-5)


def test_what_a_record_lacks_is_named(tmp_path, declared):
    time = np.arange(100) / 10e3
    values = six_tones(time)
    path = csv(tmp_path / "a.csv", time, values)
    read = lambda channels, **more: read_bearing_forces(path, channels, **more)  # noqa: E731
    with pytest.raises(InputError, match=r"bearing 'A' has no position"):
        read(declared)
    with pytest.raises(InputError, match=r"no channel 'Q'; it has t, Ax"):
        read(replace(declared, bearings=(BearingChannels("A", "Ax", "Ay", "Q"),)), positions=POSITIONS)
    with pytest.raises(InputError, match="no time axis"):
        read(replace(declared, time_channel=None), positions=POSITIONS)
    values[17, 3] = np.nan
    csv(path, time, values)
    with pytest.raises(InputError, match=r"'Bx' has no finite value in sample 17"):
        read(declared, positions=POSITIONS)


def test_unequal_channels_are_refused(tmp_path, declared):
    path = tmp_path / "a.mat"
    content = {name: np.zeros(50) for name in ("Ax", "Ay", "Az", "Bx", "By")}
    savemat(path, {**content, "Bz": np.zeros(49), "t": np.arange(50) * 1e-3})
    with pytest.raises(InputError, match=r"force channels have \[49, 50\] samples"):
        read_bearing_forces(path, declared, positions=POSITIONS)
    savemat(path, {**content, "Bz": np.zeros(50), "t": np.arange(51) * 1e-3})
    with pytest.raises(InputError, match="time axis has 51 samples, the forces 50"):
        read_bearing_forces(path, declared, positions=POSITIONS)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", b"", "line of names"),
        ("a.csv", b"t,Ax\n0,1,2\n", "2 names, but 3 columns"),
        ("a.csv", b"t,Ax\n0,1\n1,oops\n", "line of names"),
        ("a.csv", b"t,t\n0,1\n1,1\n", "names repeat"),
        ("a.csv", b"\xff\xfe\x00", "line of names"),
        ("a.mat", b"MATLAB 5.0 MAT-file" + b"\0" * 40, "not a MAT file"),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + b"\0" * 30, "damaged, truncated or not HDF5"),
        ("a.uff", b"    -1\n    58\nrubbish\n    -1\n", "universal file|no time response"),
        ("a.uff", b"hello", "universal file|no time response"),
        ("a.txt", b"", "suffix '.txt' names no known format"),
    ],
)
def test_damaged_and_foreign_files_are_refused_in_one_line(tmp_path, declared, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_bearing_forces(path, declared, positions=POSITIONS)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".h5", ".uff"])
def test_names_with_blanks_commas_and_quotes_come_back_as_written(forces, tmp_path, suffix):
    odd = forces.replace(names=(" A ", 'Läger, "轴"\nz', *(f"#{i}" for i in range(len(forces.names) - 2))))
    channels = write_bearing_forces(odd, tmp_path / f"odd{suffix}")
    assert read_bearing_forces(tmp_path / f"odd{suffix}", channels).content_hash == odd.content_hash


def test_names_that_differ_by_blanks_only_are_refused_where_a_table_cannot_tell_them_apart(forces, tmp_path):
    alike = forces.replace(names=("A", " A", *(f"{i}" for i in range(len(forces.names) - 2))))
    with pytest.raises(InputError, match="differ by blanks only"):
        write_bearing_forces(alike, tmp_path / "alike.csv")


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".h5", ".uff"])
def test_a_folder_in_the_place_of_the_file_is_refused(forces, tmp_path, suffix):
    (tmp_path / f"taken{suffix}").mkdir()
    with pytest.raises(InputError, match="a folder stands where a file is to be written"):
        write_bearing_forces(forces, tmp_path / f"taken{suffix}")


@SUFFIXES
def test_what_the_system_does_not_let_be_written_is_refused_with_its_reason(forces, tmp_path, suffix):
    (tmp_path / "a.part").mkdir()
    for name, reason in ((f"a{suffix}", "Is a directory"), ("n" * 300 + suffix, "File name too long")):
        with pytest.raises(InputError, match=rf"{name}: cannot be written \({reason}\): choose another"):
            write_bearing_forces(forces, tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["a.part"]


def test_forces_beyond_the_size_of_a_mat_file_are_sent_to_hdf5(forces, tmp_path, monkeypatch):
    monkeypatch.setattr(records, "LARGEST_MAT", forces.force.nbytes)
    with pytest.raises(InputError, match=r"exceed an array of a MAT file, .*: write \.h5"):
        write_bearing_forces(forces, tmp_path / "a.mat")
    write_bearing_forces(forces, tmp_path / "a.h5")


def test_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_record(tmp_path / "no.csv")


def test_declarations_that_contradict_themselves_are_refused(declared):
    for change, message in (
        ({"force_unit": "newton"}, "force_unit"),
        ({"acts_on": "gear"}, "housing"),
        ({"speed_channel": "n"}, "needed once"),
        ({"speed": None}, "needed once"),
        ({"speed": -100.0}, "0 or more"),
        ({"sample_rate": 1e3}, "both given"),
        ({"resample_rate": -1.0}, "above 0 Hz"),
        ({"resample_rate": 1e3, "periodic": True}, "whole periods"),
        ({"rotation": ((1.0, 0, 0), (0, 1.0, 0), (0, 0, -1.0))}, "right-handed"),
        ({"bearings": ()}, "at least one"),
    ):
        with pytest.raises(InputError, match=message):
            replace(declared, **change)


def test_declaration_can_be_a_table_with_units_in_the_keys():
    table = {
        "force_unit": "kN", "acts_on": "shaft", "speed_rpm": 2500, "time_channel": "t", "time_unit": "ms",
        "bearings": [{"name": "A", "x": "1", "y": "2", "z": "3", "position_mm": [1.0, 2.0, 3.0]}],
        "transmission_error": ["te1", "te2"], "length_unit": "um",
    }  # fmt: skip
    channels = build(ForceChannels, table, "forces")
    assert channels.speed == pytest.approx(261.799, abs=1e-3)
    assert channels.bearings[0].position == pytest.approx((1e-3, 2e-3, 3e-3))
    assert channels.transmission_error == ("te1", "te2")


def test_matlab_reads_names_and_units(forces, tmp_path):
    write_bearing_forces(forces, tmp_path / "a.mat")
    content = loadmat(tmp_path / "a.mat", simplify_cells=True)
    assert list(content["names"]) == ["A", "B"]
    assert content["units"]["force"] == "N"
    write_bearing_forces(forces, tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["force"].attrs["units"] == "N"
        assert list(file["names"].asstr()) == ["A", "B"]


def test_fields_of_a_matlab_structure_are_channels(tmp_path):
    time = np.arange(50) / 1000.0
    force = np.sin(time)
    savemat(tmp_path / "run.mat", {"run": {"t": time, "left": {"x": force, "y": 2 * force, "z": -force}}})
    meaning = ForceChannels(
        (BearingChannels("A1", "run.left.x", "run.left.y", "run.left.z", (0.0, 0.0, 0.0)),),
        force_unit="N",
        acts_on="housing",
        speed=10.0,
        time_channel="run.t",
    )
    found = read_bearing_forces(tmp_path / "run.mat", meaning)
    assert np.array_equal(found.force[:, 0], np.stack([force, 2 * force, -force], axis=1))
    assert found.sample_rate == pytest.approx(1000.0)


def test_a_channel_given_twice_and_a_position_in_millimetres_are_refused():
    with pytest.raises(InputError, match="name a channel twice"):
        BearingChannels("A1", "fx", "fy", "fx")
    with pytest.raises(InputError, match="position_mm"):
        BearingChannels("A1", "fx", "fy", "fz", (120.0, 30.0, 85.0))
    with pytest.raises(InputError, match="channels fz are given to two bearings"):
        ForceChannels(
            (BearingChannels("A1", "fx", "fy", "fz"), BearingChannels("A2", "gx", "gy", "fz")),
            force_unit="N",
            acts_on="housing",
            speed=10.0,
            sample_rate=1000.0,
        )


def test_a_table_with_semicolons_says_how_tables_are_written(tmp_path, declared):
    (tmp_path / "forces.csv").write_text("t;fx;fy;fz\n0,0;1,5;2;3\n0,1;1;2;3\n")
    with pytest.raises(InputError, match="commas between them and decimal points"):
        read_bearing_forces(tmp_path / "forces.csv", declared)


def test_a_resampled_speed_does_not_turn_backwards_where_the_input_starts(declared, tmp_path):
    time = np.arange(4000) / 4e3
    speed = np.maximum(0.0, 200.0 * (time - 0.5))
    names = [f"{bearing.name}{axis}" for bearing in declared.bearings for axis in "xyz"]
    bearings = tuple(BearingChannels(b.name, *(f"{b.name}{axis}" for axis in "xyz")) for b in declared.bearings)
    header, table = ",".join(["t", "speed", *names]), np.column_stack([time, speed, *[np.sin(time)] * len(names)])
    np.savetxt(tmp_path / "up.csv", table, delimiter=",", header=header, comments="")
    channels = replace(
        declared,
        bearings=bearings,
        time_channel="t",
        time_unit="s",
        speed=None,
        speed_channel="speed",
        resample_rate=1.1e3,
    )
    read = read_bearing_forces(tmp_path / "up.csv", channels, positions=POSITIONS)
    assert read.input_speed.min() == 0.0
    np.testing.assert_allclose(read.input_speed, np.maximum(0.0, 200.0 * (read.time - 0.5)), atol=0.02)


def one_bearing(*names, **more):
    """Declaration of a bearing at the origin; N on the housing at 1 kHz."""
    stated = {"force_unit": "N", "acts_on": "housing", "speed": 10.0, "sample_rate": 1e3} | more
    return ForceChannels((BearingChannels("A", *names, (0.0, 0.0, 0.0)),), **stated)


@pytest.mark.parametrize("columns", [1, 3])
def test_a_unit_counts_whatever_the_name_of_its_dataset(tmp_path, columns):
    force = np.sin(np.arange(100.0))
    names = ["F [x]", "F [y]", "F [z]"] if columns == 1 else [f"F [left][{i}]" for i in range(3)]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in names if columns == 1 else ["F [left]"]:
            file[name] = force if columns == 1 else np.stack([force] * 3, axis=1)
            file[name].attrs["units"] = "kN"
    with pytest.raises(InputError, match=r"'F \[.*\]' is in 'kN' by the file, but 'N' is declared"):
        read_bearing_forces(tmp_path / "a.h5", one_bearing(*names))
    found = read_bearing_forces(tmp_path / "a.h5", one_bearing(*names, force_unit="kN"))
    np.testing.assert_array_equal(found.force[:, 0, 2], 1e3 * force)


def test_a_unit_in_the_name_of_a_channel_must_agree(tmp_path):
    force = np.sin(np.arange(100.0))
    path = csv(tmp_path / "a.csv", force, np.stack([force] * 2, axis=1), header="Fx [kN],Fy [kN],Fz [kN]")
    names = ["Fx [kN]", "Fy [kN]", "Fz [kN]"]
    with pytest.raises(InputError, match=r"'Fx \[kN\]' is in 'kN' by its name, but 'N' is declared"):
        read_bearing_forces(path, one_bearing(*names))
    assert read_bearing_forces(path, one_bearing(*names, force_unit="kN")).force.max() == 1e3 * force.max()
    # no unit of force: a side, a number, a bearing's own name before the axis
    path = csv(tmp_path / "b.csv", force, np.stack([force] * 2, axis=1), header="Fx [S],Fy [2],B [kN]:z")
    assert read_bearing_forces(path, one_bearing("Fx [S]", "Fy [2]", "B [kN]:z")).force.max() == force.max()


def test_two_arrays_with_channels_of_one_name_are_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["F"], file["F[0]"] = np.ones((9, 2)), np.ones(9)
    with pytest.raises(InputError, match=r"two arrays have channels called F\[0\]"):
        read_record(tmp_path / "a.h5")


@pytest.mark.parametrize(
    ("text", "unit"),
    [("NEWTONS", "N"), ("Newton", "N"), ("[N]", "N"), ("(kN)", "kN"), ("KN", "kN"), ("MN", "MN"), ("mN", "mN"),
     ("mn", None), ("Nm", None), ("", None), ("SEC", "s"), ("S", "s"), ("Seconds", "s"), ("µs", "us"), ("μm", "um"),
     ("1/min", "rpm"), ("°", "deg")],
)  # fmt: skip
def test_units_are_known_by_the_names_that_files_use(text, unit):
    assert unit_called(text) == unit


@pytest.mark.parametrize("stated", [np.array([b"N"]), np.array(["newton"], dtype=object), b"N", "N", ""])
def test_a_unit_may_be_an_attribute_of_any_kind_of_text(tmp_path, stated):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "xyz":
            file[name] = np.arange(9.0)
            file[name].attrs["units"] = stated
    assert len(read_bearing_forces(tmp_path / "a.h5", one_bearing(*"xyz")).time) == 9
    if len(stated):
        with pytest.raises(InputError, match="by the file, but 'kN' is declared"):
            read_bearing_forces(tmp_path / "a.h5", one_bearing(*"xyz", force_unit="kN"))


def test_units_of_several_columns_count_in_a_cell_array_and_an_attribute(tmp_path):
    table = np.arange(27.0).reshape(9, 3)
    names = [f"F[{i}]" for i in range(3)]
    for texts, message in ((["kN"] * 3, r"'F\[0\]' is in 'kN' by"), (["N", "N", "kN"], r"'F\[0\]' is in 'N, kN' by")):
        savemat(tmp_path / "a.mat", {"F": table, "units": {"F": np.array(texts, dtype=object)}})
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["F"] = table
            file["F"].attrs["unit"] = texts
        for path in (tmp_path / "a.mat", tmp_path / "a.h5"):
            with pytest.raises(InputError, match=message):
                read_bearing_forces(path, one_bearing(*names))
    savemat(tmp_path / "a.mat", {"F": table, "units": {"F": np.array(["N"] * 3, dtype=object)}})
    assert read_bearing_forces(tmp_path / "a.mat", one_bearing(*names)).force[1, 0].tolist() == [3.0, 4.0, 5.0]


def test_units_of_a_table_may_stand_in_brackets_and_be_spelled_out(tmp_path):
    time = np.arange(100) / 10e3
    path = csv(tmp_path / "a.csv", time, six_tones(time)[:, :3], header="t,x,y,z", units="[sec],[N],Newton,NEWTONS")
    found = read_bearing_forces(path, one_bearing(*"xyz", sample_rate=None, time_channel="t"))
    assert found.sample_rate == pytest.approx(10e3)


TABLES = {
    "quoted": '"t","x","y","z"\n"s","N","N","N"\n"0.0","1","2","3"\n"0.001","4","5","6"\n',
    "commas at the ends": "t,x,y,z,\ns,N,N,N,\n0.0,1,2,3,\n0.001,4,5,6,\n",
    "comma below the names only": "t,x,y,z\ns,N,N,N\n0.0,1,2,3,\n0.001,4,5,6,\n",
    "header of numpy": "# a run, with, two, samples\n# t,x,y,z\n# s,N,N,N\n0.0,1,2,3\n0.001,4,5,6\n",
    "indented comment": "  # made by hand, once\nt,x,y,z\n  # units\ns,N,N,N\n0.0,1,2,3\n0.001,4,5,6 # last\n",
    "names alone": "# by hand\n#t, x, y, z\n0.0,1,2,3\n0.001,4,5,6\n",
}


@pytest.mark.parametrize("layout", TABLES)
def test_tables_are_read_as_spreadsheets_and_numpy_write_them(tmp_path, layout):
    (tmp_path / "a.csv").write_text(TABLES[layout])
    channels = one_bearing(*"xyz", sample_rate=None, time_channel="t")
    found = read_bearing_forces(tmp_path / "a.csv", channels)
    np.testing.assert_array_equal(found.force[:, 0], [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(found.time, [0.0, 1e-3])
    if layout != "names alone":
        with pytest.raises(InputError, match="'x' is in 'N' by the file, but 'kN' is declared"):
            read_bearing_forces(tmp_path / "a.csv", replace(channels, force_unit="kN"))


@pytest.mark.parametrize(
    ("text", "message"),
    [("0,1,1,1\n1,2,2,2\n", "names repeat: 0, 1, 1, 1: put a line"), ("t,x\ns,N\n", "ends before the first number"),
     ("t,x\n0,1\n1,2,3\n", "number of columns changed"), ("t,x\n0,\n1,\n", "2 names, but 1 columns")],
)  # fmt: skip
def test_tables_without_names_numbers_or_equal_rows_are_refused(tmp_path, text, message):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read_record(tmp_path / "a.csv")
