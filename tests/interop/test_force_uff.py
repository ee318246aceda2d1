"""Universal files of foreign forces, dataset 58: axes, directions, units and labels as the format defines them."""

from dataclasses import replace

import numpy as np
import pytest
import pyuff

from nvhchain.errors import InputError
from nvhchain.handoff import FieldPressure
from nvhchain.interop import read_bearing_forces, read_record, write_bearing_forces, write_spectrum_uff
from nvhchain.testing.hand_offs import RATE


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
        (lambda s: s[2].update(abscissa_axis_units_lab="min"), "1:y has its time in 'min': s, ms, us are known"),
        (lambda s: s[2].update(abscissa_axis_units_lab="ms"), "1:y has another time axis than 1:x"),
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


def test_uff_time_in_milliseconds_is_read_as_its_label_says(forces, tmp_path):
    path = tmp_path / "a.uff"
    channels = write_bearing_forces(forces, path)
    kept = [dict(s) for s in pyuff.UFF(str(path)).read_sets()]
    for each in kept:
        each.update(abscissa_axis_units_lab="msec", x=1e3 * each["x"])
        each.update(abscissa_min=1e3 * each["abscissa_min"], abscissa_inc=1e3 * each["abscissa_inc"])
    pyuff.UFF(str(tmp_path / "b.uff")).write_sets(kept, mode="add")
    assert pyuff.UFF(str(tmp_path / "b.uff")).read_sets(0)["x"][-1] == pytest.approx(1e3 * forces.time[-1])
    assert read_bearing_forces(tmp_path / "b.uff", channels).force.tobytes() == forces.force.tobytes()
    own = read_bearing_forces(tmp_path / "b.uff", replace(channels, sample_rate=None))
    assert own.sample_rate == pytest.approx(RATE, rel=1e-5)


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
    odd = forces.replace(names=("A" * 80, "Läger, '轴' z"), output_lag=np.zeros(500), time=forces.time + 12.3456)
    write_bearing_forces(odd, tmp_path / "a.uff")
    sets = [dict(s) for s in pyuff.UFF(str(tmp_path / "a.uff")).read_sets()]
    assert len(sets) == 8
    pyuff.UFF(str(tmp_path / "b.uff")).write_sets(sets, mode="add")
    assert (tmp_path / "a.uff").read_bytes() == (tmp_path / "b.uff").read_bytes()


def test_uff_without_stated_rate_uses_its_own_axis(forces, tmp_path):
    path = tmp_path / "a.uff"
    channels = replace(write_bearing_forces(forces, path), sample_rate=None)
    assert read_bearing_forces(path, channels).sample_rate == pytest.approx(RATE, rel=1e-5)


def test_complex_spectra_of_microphones_are_read_by_pyuff(tmp_path):
    frequency = np.array([100.0, 150.5, 4999.25])  # unevenly spaced
    pressure = np.array([[1 + 2j, 0.0], [-3e-5j, 1.0], [0.125, -7.0 - 1e-9j]])
    path = write_spectrum_uff(FieldPressure(frequency, np.eye(3)[:2], pressure), tmp_path / "a.unv", names=["front"])
    sets = [dict(each) for each in pyuff.UFF(str(path)).read_sets()]
    assert [of["id1"].strip() for of in sets] == ["front", "microphone 2"]
    for number, of in enumerate(sets):
        assert (of["func_type"], of["ordinate_spec_data_type"], of["rsp_node"]) == (12, 15, number + 1)
        np.testing.assert_allclose(of["x"], frequency, rtol=1e-6)
        np.testing.assert_allclose(of["data"], pressure[:, number], rtol=1e-11)


def rewritten(path, other, *changes, system=None):
    """Write sets of `path` to `other`, changed by number, below the code of a system of units."""
    sets = [dict(s) for s in pyuff.UFF(str(path)).read_sets()]
    for numbers, change in changes:
        for number in numbers:
            sets[number].update(change)
    head = [] if system is None else [pyuff.prepare_164(1, "", 2, 1.0, 1.0, 1.0, 0.0) | {"units_code": system}]
    other.unlink(missing_ok=True)
    pyuff.UFF(str(other)).write_sets([*head, *sets], mode="add")
    return other


def test_a_reaction_force_beside_an_excitation_is_no_rotation(forces, tmp_path):
    channels = write_bearing_forces(forces, tmp_path / "a.uff")
    excitation = {"rsp_node": 1, "rsp_dir": 1, "ordinate_spec_data_type": 13}
    path = rewritten(tmp_path / "a.uff", tmp_path / "b.uff", ([4], excitation))
    assert {"1:x:reaction force", "1:x:excitation force"} < read_record(path).channels.keys()
    one = replace(channels, bearings=(replace(channels.bearings[0], x="1:x:reaction force"),))
    assert (read_bearing_forces(path, one).force[:, 0] == forces.force[:, 0]).all()


@pytest.mark.parametrize(
    ("code", "force", "moment", "value"),
    [(1, "N", "N m", 1.0), (5, "mN", "mN mm", 1e-6), (7, "lbf", "lbf in", 0.112984829), (10, "N", "N mm", 1e-3)],
)
def test_moments_follow_the_system_of_units_of_their_file(forces, tmp_path, code, force, moment, value):
    """Values of moments by hand: 1 lbf in = 4.44822 N · 25.4 mm."""
    moved = forces.replace(moment=np.random.default_rng(3).standard_normal((500, 2, 2)))
    channels = write_bearing_forces(moved, tmp_path / "a.uff")
    bare = (range(1, 11), {"ordinate_axis_units_lab": "NONE"})
    path = rewritten(tmp_path / "a.uff", tmp_path / "b.uff", bare, system=code)
    if moment != "N m":
        with pytest.raises(InputError, match=f"'1:rx' is in '{moment}' by the file, but 'N m' is declared"):
            read_bearing_forces(path, replace(channels, force_unit=force))
    found = read_bearing_forces(path, replace(channels, force_unit=force, moment_unit=moment))
    np.testing.assert_allclose(found.moment, value * moved.moment, rtol=1e-8)


@pytest.mark.parametrize("code", [None, 9])
def test_moments_without_stated_unit_have_the_declared_one(forces, tmp_path, code):
    """No system of units, or one of the user's own."""
    moved = forces.replace(moment=np.random.default_rng(3).standard_normal((500, 2, 2)))
    channels = write_bearing_forces(moved, tmp_path / "a.uff")
    bare = (range(1, 11), {"ordinate_axis_units_lab": "NONE"})
    path = rewritten(tmp_path / "a.uff", tmp_path / "b.uff", bare, system=code)
    found = read_bearing_forces(path, replace(channels, moment_unit="kN m"))
    assert (found.moment == 1e3 * moved.moment).all()


def test_forces_are_no_moments_in_a_universal_file(forces, tmp_path):
    moved = forces.replace(moment=np.ones((500, 2, 2)))
    channels = write_bearing_forces(moved, tmp_path / "a.uff")
    path = rewritten(tmp_path / "a.uff", tmp_path / "b.uff", (range(1, 11), {"ordinate_axis_units_lab": "NONE"}))
    swapped = replace(channels, bearings=(replace(channels.bearings[1], mx="1:x"),))
    with pytest.raises(InputError, match="1:x is no rotation: moments are needed"):
        read_bearing_forces(path, swapped)
