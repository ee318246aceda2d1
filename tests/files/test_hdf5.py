"""Hand-offs survive the disk unchanged; damaged or foreign files are refused."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from nvhchain.conventions import Air
from nvhchain.errors import AccuracyWarning, FileFormatError, InputError
from nvhchain.files import hdf5
from nvhchain.handoff import (
    ACCURACIES,
    HAND_OFFS,
    BearingForces,
    BodyModes,
    Directivity,
    FieldPressure,
    FlankFlexibility,
    ForceAccuracy,
    ForceSpectrum,
    GearField,
    LoadDistribution,
    MeshLaw,
    MeshPeriod,
    ModalTransferVectors,
    NoiseTransferFunctions,
    PressureHistory,
    RadiationEfficiency,
    RadiationResistance,
    ReducedHousing,
    RigidPlane,
    SolvedBand,
    SolverRecord,
    SoundAccuracy,
    SoundPower,
    Surface,
    SurfaceAccuracy,
    SurfacePressure,
    SurfaceVelocity,
    ToothPairs,
    TransferVectors,
)

SURFACE = Surface([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
EXAMPLES = [
    SURFACE,
    MeshLaw([0.0, 0.1], [0.0, 1e-5], [[0.0, 5.0], [0.0, 6.0]], 0.2, (20, 50), [0.025, 0.06], 0.16, 0.35, 0.09, 0.022),
    MeshLaw(
        [0.0, 0.1], [0.0, 1e-5], [[0.0, 5.0], [0.0, 6.0]], 0.2, (20, 50), [0.025, 0.06], 0.16, 0.35, 0.09, 0.022, 1.65
    ),
    ToothPairs(
        [0.0, 0.1],
        0.2,
        1e-5,
        [0.0, 1e-6],
        np.ones((2, 2), dtype=int),
        np.zeros((2, 2, 1), dtype=int),
        *(np.ones((2, 2, 1)), np.ones((2, 2, 1, 2)), np.ones((2, 2, 1, 1))),
        *[np.ones((2, 2, 1, 1))] * 4,
        *[np.ones((2, 2, 2, 1, 1))] * 3,
        *(np.ones((2, 2, 1, 1)), np.ones((2, 2, 1, 1)), np.ones((2, 2, 1, 1, 1)), [0, 1]),
    ),
    BodyModes([2e3, 3e3], [0, 1], [0.0, 0.2], np.full((2, 3), 0.1 + 0.2j), np.full((2, 3), 0.3j)),
    FlankFlexibility([0.06, 0.07], [0.0], 50, np.ones((5, 2, 3, 3)), np.ones((3, 4)), [0.0], np.eye(4)),
    LoadDistribution([0.0, 0.1], 0.2, [0.5, -0.2], [0.01, 0.02], [1e-3, -1e-3], 5e3, 1.65),
    MeshPeriod(
        LoadDistribution([0.0, 0.1], 0.2, [0.5, -0.2], [0.01, 0.02], [1e-3, -1e-3], 5e3, 1.65), [1e-5, 2e-5], 4e8
    ),
    GearField(
        np.eye(10, 3), np.arange(10)[None], np.full((10, 3), 1e-6), np.arange(10.0), "wheel", 0.1, 57, 2e-3, 0.4, 0.05,
        [3], [[0.06, 0, 0]], [[0.0, -9.0, 1.0]], [1e-6], 0.3,
    ),
    BearingForces(
        [0.0, 1.0, 2.0], np.arange(9.0).reshape(3, 1, 3), ("A1",), [[0.0, 1, 2]], 261.8,
        transmission_error=np.ones((3, 2)), output_lag=np.ones(3),
    ),
    BearingForces([0.0, 1.0, 2.0], np.arange(9.0).reshape(3, 1, 3), ("A1",), [[0.0, 1, 2]], 261.8, periodic=True),
    ForceSpectrum([10.0, 20.0], np.full((2, 1, 3), 1 - 2j), ("A1",), 261.8),
    ReducedHousing(
        [100.0], [0.02], [[[1.0, 2, 3]]], [[1.0, 2, 3, 4]], np.eye(3).reshape(1, 3, 1, 3), np.ones((1, 3, 4)),
        ("A1",), [[0.0, 0, 0]], SURFACE,
    ),
    SurfaceVelocity([50.0], [[1j, 2, 3, 4]], SURFACE),
    SurfaceVelocity.superposition([50.0, 60.0], [[1j], [2.0]], [[1.0, 2, 3, 4]], SURFACE),
    TransferVectors([50.0], [[0.0, 0, 5]], np.full((1, 1, 4), 2 + 1j), SURFACE, Air(340.0, 1.2)),
    TransferVectors(
        [50.0], [[0.0, 0, 5]], np.full((1, 1, 4), 2 + 1j), SURFACE, Air(340.0, 1.2),
        RigidPlane((0.1, 0, -2), (1.0, 2, 7)), np.full((1, 1, 4), 1j),
    ),
    ModalTransferVectors(
        [50.0], [[0.0, 0, 5]], np.full((1, 1, 2), 2 + 1j), np.full((1, 1, 1, 3), 3j), ("A1",), "abc",
        Air(340.0, 1.2),
    ),
    NoiseTransferFunctions([50.0], [[0.0, 0, 5]], np.full((1, 1, 1, 3), 3j), ("A1",), Air(340.0, 1.2)),
    RadiationResistance([50.0], np.full((1, 4, 2), 1 + 2j), np.eye(2), Air(340.0, 1.2), 0.3, housing="abc"),
    RadiationResistance(
        [50.0], np.full((1, 4, 2), 1 + 2j), np.eye(2), Air(340.0, 1.2), 0.3, cancellation=np.full((1, 2, 2), 3 + 1j),
        wall_waves=np.eye(2),
    ),
    PressureHistory([0.0, 0.1], [[0.0, 0, 5]], [[1.0], [2.0]], 261.8),
    SurfacePressure([50.0], [[1 + 1j, 2, 3, 4]], SURFACE),
    SoundPower([50.0], [1e-3], 261.8),
    RadiationEfficiency([50.0], [0.3], 261.8),
    Directivity([50.0], [[0.0, 0, 5]], [[-3.0]], 261.8),
    SolvedBand([50.0, 60.0], np.full((2, 6), 1 + 2j), [2, 3]),
    SURFACE.replace(accuracy=SurfaceAccuracy(0.01)),
    TransferVectors(
        [50.0], [[0.0, 0, 5]], np.full((1, 1, 4), 2 + 1j), SURFACE.replace(accuracy=SurfaceAccuracy(0.01)),
        Air(340.0, 1.2), accuracy=SoundAccuracy(expected_error_db=0.3, deciding_points=7, radiation="rayleigh"),
    ),
    BearingForces(
        [0.0, 1.0, 2.0], np.ones((3, 1, 3)), ("A1",), [[0.0, 0, 0]], 1.0,
        accuracy=ForceAccuracy(("A–B", "A–B"), [0.0, 1.0], [2.0, 3.0], [1.0, 1.0], [2.0, 2.0]),
    ),
    SolvedBand([50.0, 60.0], np.full((2, 6), 1 + 2j), [2, 3], SolverRecord(("direct",), condition=0.1)),
    FieldPressure(
        [50.0, 60.0], [[0.0, 0, 5]], [[1 + 1j], [2 - 1j]], 261.8, SoundAccuracy(interpolation_error=[0.01])
    ),
]  # fmt: skip


def test_every_hand_off_kind_is_in_the_examples():
    assert {type(e).__name__ for e in EXAMPLES} == set(HAND_OFFS)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: type(e).__name__)
def test_round_trip_keeps_content_and_provenance(tmp_path, example):
    example = example.replace(provenance={"stage": "test", "fidelity": {"a": 1}})
    loaded = hdf5.load(hdf5.save(example, tmp_path / "x.h5"), type(example))
    assert loaded.content_hash == example.content_hash
    assert loaded.provenance == example.provenance


def test_accuracy_is_stored_as_a_group_with_units(tmp_path):
    path = hdf5.save(EXAMPLES[-1], tmp_path / "p.h5")
    with h5py.File(path) as file:
        stated = file["accuracy"]
        assert stated.attrs["kind"] == "SoundAccuracy"
        assert stated["interpolation_error"].attrs["units"] == "1"
        assert stated["interpolation_error"][()].tolist() == [0.01]
    assert hdf5.stated(path, FieldPressure, SoundAccuracy) == EXAMPLES[-1].accuracy
    assert EXAMPLES[-1].to_xarray().interpolation_error.dims == ("point",)


def test_complex_arrays_are_stored_as_labelled_real_pairs_with_units(tmp_path):
    path = hdf5.save(EXAMPLES[-1], tmp_path / "p.h5")
    with h5py.File(path) as file:
        pressure = file["pressure"]
        assert pressure.shape == (2, 1, 2)
        assert pressure.dims[0]["frequency"][()].tolist() == [50.0, 60.0]
        assert pressure.dims[2]["re_im"].asstr()[()].tolist() == ["re", "im"]
        assert pressure.attrs["units"] == "Pa"
        assert pressure[1, 0].tolist() == [2.0, -1.0]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: type(e).__name__)
def test_xarray_opens_every_hand_off_with_named_axes(tmp_path, example):
    path = hdf5.save(example, tmp_path / "x.h5")
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        names = {axis for part in tree.subtree for axis in part.sizes}
        assert names - {"re_im"} == set(example.sizes)
        for quantity, given in example.given():
            if quantity.dims and not quantity.absent(given):
                is_complex = np.iscomplexobj(given)
                assert tree[quantity.name].dims == (*quantity.dims, *(["re_im"] if is_complex else []))
                stored = tree[quantity.name].values
                assert np.array_equal(stored[..., 0] + 1j * stored[..., 1] if is_complex else stored, given)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: type(e).__name__)
def test_to_xarray_holds_all_fields_with_units_and_complex_numbers(example):
    made = example.to_xarray()
    for quantity, given in example.given():
        if quantity.dims and not quantity.absent(given):
            assert np.array_equal(made[quantity.name].values, given)
            assert (made[quantity.name].units, made[quantity.name].dims) == (quantity.unit, quantity.dims)
    inside = [given for _, given in example.given() if isinstance(given, Surface)]
    assert all(np.array_equal(made.vertices, surface.vertices) for surface in inside)


def test_bearings_are_found_by_name(tmp_path):
    forces = next(e for e in EXAMPLES if isinstance(e, ForceSpectrum))
    assert forces.to_xarray().force.sel(bearing="A1", axis="y", frequency=20.0).item() == 1 - 2j
    with xarray.open_dataset(hdf5.save(forces, tmp_path / "f.h5"), engine="h5netcdf") as file:
        assert file.force.sel(bearing="A1", axis="y", frequency=20.0, re_im="im").item() == -2.0


def test_a_superposition_is_stored_as_its_factors(tmp_path):
    rng = np.random.default_rng(1)
    shape, lines = rng.normal(size=(3, 4)), np.arange(1.0, 1001.0)
    moving = SurfaceVelocity.superposition(lines, rng.normal(size=(1000, 3)) * (1 + 2j), shape, SURFACE)
    path = hdf5.save(moving, tmp_path / "v.h5")
    with h5py.File(path) as file:
        assert "normal_velocity" not in file
        assert file["coordinates"].shape == (1000, 3, 2)
    again = hdf5.load(path, SurfaceVelocity)
    assert np.array_equal(again.normal_velocity, moving.normal_velocity)
    assert np.allclose(again.normal_velocity, 2j * np.pi * lines[:, None] * (moving.coordinates @ shape), rtol=1e-13)


def test_a_hand_off_of_the_documentation_is_complete_by_its_declarations(tmp_path, monkeypatch):
    page = Path(__file__).parents[2] / "docs" / "developers" / "add_a_handoff.md"
    names: dict = {"__name__": "example"}
    for name in ("FieldIntensity", "ComplexIntensity", "ActiveIntensity"):
        monkeypatch.setitem(HAND_OFFS, name, None)  # and so it is forgotten afterwards
    for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
        exec(block, names)
    intensity = names["made"]
    again = hdf5.load(hdf5.save(intensity, tmp_path / "i.h5"), names["FieldIntensity"])
    assert again.content_hash == intensity.content_hash
    with pytest.raises(InputError, match=r"FieldIntensity.intensity has shape \(3, 1, 3\), but \(2, 1, 3\) is needed"):
        intensity.replace(intensity=np.ones((3, 1, 3)))
    assert "intensity : array of float (frequency, point, axis), W/m2" in names["FieldIntensity"].__doc__
    assert names["ComplexIntensity"](again.frequency, again.points, again.intensity).reactive is None


def test_an_accuracy_of_the_documentation_is_complete_by_its_declarations(tmp_path, monkeypatch):
    page = Path(__file__).parents[2] / "docs" / "developers" / "add_an_accuracy_field.md"
    names: dict = {"__name__": "example"}
    monkeypatch.setitem(HAND_OFFS, "MeasuredIntensity", None)
    monkeypatch.setitem(ACCURACIES, "IntensityAccuracy", None)
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    with pytest.warns(AccuracyWarning, match=r"differ by 0\.1 rad, 0\.02 asked: calibrate them"):
        exec("\n".join(blocks), names)
    made = names["made"]
    assert hdf5.load(hdf5.save(made, tmp_path / "i.h5"), type(made)).accuracy == made.accuracy


def test_large_arrays_take_less_space_and_keep_their_bits(tmp_path):
    time = np.arange(50_000) / 1e4
    force = np.round(np.sin(time)[:, None, None] * np.ones((2, 3)), 3)
    forces = BearingForces(time, force, ("A", "B"), [[0.0, 0, 0], [0.1, 0, 0]], 9.0)
    path = hdf5.save(forces, tmp_path / "forces.h5")
    assert path.stat().st_size < 0.5 * (force.nbytes + time.nbytes)
    assert np.array_equal(hdf5.load(path, BearingForces).force, force)


def test_truncated_file_is_refused(tmp_path):
    path = hdf5.save(SURFACE, tmp_path / "s.h5")
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(FileFormatError, match=r"s\.h5"):
        hdf5.load(path)


def test_foreign_hdf5_and_other_files_are_refused(tmp_path):
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["x"] = 1.0
    (tmp_path / "text.h5").write_text("hello")
    for name in ("foreign.h5", "text.h5", "absent.h5"):
        with pytest.raises(FileFormatError, match=name):
            hdf5.load(tmp_path / name)


def test_altered_content_is_found_by_its_checksum(tmp_path):
    path = hdf5.save(EXAMPLES[-1], tmp_path / "p.h5")
    with h5py.File(path, "r+") as file:
        file["pressure"][0, 0, 0] = 7.0
    with pytest.raises(FileFormatError, match="checksum"):
        hdf5.load(path)


@pytest.mark.parametrize("reader", [hdf5.load, hdf5.record])
def test_a_damaged_bit_anywhere_is_found_before_the_file_is_parsed(reader, tmp_path, monkeypatch):
    """Of 5072 files with a damaged bit outside the values HDF5 2.0 crashed on nine and never returned from nine."""
    whole = hdf5.save(EXAMPLES[-1], tmp_path / "p.h5").read_bytes()
    monkeypatch.setattr(hdf5, "h5py", None)
    for byte in range(0, len(whole), 61):
        (tmp_path / "p.h5").write_bytes(whole[:byte] + bytes([whole[byte] ^ 1 << byte % 8]) + whole[byte + 1 :])
        with pytest.raises(FileFormatError, match=r"p\.h5: (not an nvhchain hand-off|damaged)"):
            reader(tmp_path / "p.h5")


def test_altered_provenance_is_found(tmp_path):
    path = hdf5.save(EXAMPLES[-1], tmp_path / "p.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["provenance"] = "{}"
    with pytest.raises(FileFormatError, match="altered"):
        hdf5.load(path)


def test_a_file_of_an_older_schema_is_refused(tmp_path, monkeypatch):
    with monkeypatch.context() as before:
        before.setattr(hdf5, "SCHEMA_VERSION", hdf5.SCHEMA_VERSION - 1)
        path = hdf5.save(FieldPressure([50.0], [[0.0, 0, 1]], [[1.0 + 1j]]), tmp_path / "old.h5")
    with pytest.raises(FileFormatError, match=r"old\.h5: schema 2 is older than 3 and no longer read: make it anew"):
        hdf5.load(path)


def test_a_file_of_a_newer_schema_is_refused(tmp_path, monkeypatch):
    with monkeypatch.context() as later:
        later.setattr(hdf5, "SCHEMA_VERSION", hdf5.SCHEMA_VERSION + 1)
        path = hdf5.save(SURFACE, tmp_path / "s.h5")
    with pytest.raises(FileFormatError, match="newer"):
        hdf5.load(path)


def test_wrong_kind_is_refused(tmp_path):
    with pytest.raises(FileFormatError, match="holds Surface"):
        hdf5.load(hdf5.save(SURFACE, tmp_path / "s.h5"), FieldPressure)


def test_failed_save_leaves_neither_file_nor_fragment(tmp_path, monkeypatch):
    monkeypatch.setattr(hdf5, "_write", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        hdf5.save(SURFACE, tmp_path / "s.h5")
    assert list(tmp_path.iterdir()) == []


def test_repeated_periods_of_a_record_take_little_more_space_than_one(tmp_path):
    one = np.random.default_rng(1).normal(size=(25000, 1, 3))
    sizes = []
    for number, force in enumerate((one, np.concatenate([one, one]))):
        time = np.arange(len(force)) * 1e-4
        path = tmp_path / f"{number}.h5"
        hdf5.save(BearingForces(time, force, ("A",), np.zeros((1, 3)), np.full(len(time), 100.0)), path)
        sizes.append(path.stat().st_size)
    assert sizes[1] < 1.4 * sizes[0]
