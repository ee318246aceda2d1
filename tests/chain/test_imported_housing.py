"""A housing from another program's file, solid model or modal results, takes the place of the casting."""

import re
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import HousingModel, ModalResults, SeatNode, SurfaceFile
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity, HousingFidelity
from nvhchain.housing import bearing_seats, modal_model
from nvhchain.housing.casting.mesh import mesh_casting
from nvhchain.interop import read_nastran, write_modal_hdf5, write_modal_uff, write_nastran, write_vtu
from nvhchain.scene import preflight
from tests.housing.casting_model import casting_model

pytestmark = [
    pytest.mark.usefixtures("common_operators"),
    pytest.mark.filterwarnings(
        "ignore:.*of the skin lie on skin that faces it",
        "ignore:.*tetrahedra are .* as long as the wall",
        "ignore:housing elements of",
        "ignore:rayleigh at",
    ),
]

FIDELITY = HousingFidelity(element_size=0.02, elements_per_turn=10, corrected_frequencies=False)
"""Frequencies as the elements have them, which modal results of other solvers hold."""
MODAL_BAND = 2500.0
"""Hz, above the first modes."""


@pytest.fixture(scope="module")
def folder(request, tmp_path_factory):
    """A case file of the small gearbox; beside it its casting as Nastran bulk data in millimetres, held and free."""
    folder = tmp_path_factory.mktemp("foreign")
    base = request.config.rootpath / "cases/small/single_stage.toml"
    casting = nvh.load_case(base).housing
    write_nastran(casting_model(mesh_casting(casting, FIDELITY), casting), folder / "housing.bdf", units="mm-t-s")
    lines = (folder / "housing.bdf").read_text().splitlines(keepends=True)
    (folder / "free.bdf").write_text("".join(line for line in lines if not line.startswith(("SPC1", "SPC ="))))
    (folder / "case.toml").write_text(
        f'base = "{base}"\nquantities = ["surface_velocity"]\n[band]\nhigh = 1500\n'
        '[housing]\ntype = "housing_model"\nfile = "housing.bdf"\nunits = "mm-t-s"\nmodal_damping = 0.02\n'
        "mounting_plane = { point = [0, 0, 0], normal = [0, 0, -1] }\n"
    )
    return folder


@pytest.mark.slow
def test_gearbox_in_an_imported_housing_moves_like_in_the_casting(request, folder, coarse):
    fine_faces = replace(coarse.acoustics, elements_per_wavelength=10.0)
    fidelity = replace(coarse, housing=FIDELITY, acoustics=fine_faces)
    foreign = nvh.load_case(folder / "case.toml")
    assert isinstance(foreign.housing, HousingModel)
    preflight(foreign, fidelity)
    own = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    own = replace(own, band=foreign.band, quantities=foreign.quantities)
    first = nvh.run(own, fidelity=fidelity)
    second = nvh.run(foreign, fidelity=fidelity, mesh_laws=first.mesh_laws)
    assert second.housing.names == first.housing.names
    np.testing.assert_allclose(second.housing.natural_frequency, first.housing.natural_frequency, rtol=1e-8)
    np.testing.assert_allclose(second.force_spectrum.force, first.force_spectrum.force, atol=1e-3 * 60.0)
    flux = [
        np.sqrt((np.abs(result.surface_velocity.normal_velocity) ** 2) @ result.surface_velocity.surface.areas)
        for result in (first, second)
    ]
    loud = flux[0] > 0.1 * flux[0].max()
    assert np.abs(20 * np.log10(flux[1][loud] / flux[0][loud])).max() < 1.0  # faces of their own, 23 mm


@pytest.fixture(scope="module")
def modal_results(folder, coarse):
    """(fidelity, run of the solid model, folder with its modes and residual vectors in both formats beside it)."""
    sound = replace(coarse.acoustics, elements_per_wavelength=6.0, radiation="rayleigh")
    fidelity = replace(coarse, housing=FIDELITY, acoustics=sound, dynamics=DynamicsFidelity(time_step=20e-6))
    solid = nvh.load_case(folder / "case.toml")
    solid = replace(solid, quantities=("pressure",), band=replace(solid.band, high=MODAL_BAND))
    result = nvh.run(solid, fidelity=fidelity)
    model = read_nastran(folder / "housing.bdf", units="mm-t-s")
    seats = bearing_seats(model, solid.seats)
    modes = modal_model(model, seats, f_top=FIDELITY.mode_ratio * MODAL_BAND, modal_damping=solid.housing.modal_damping)
    write_modal_uff(modes, folder / "modes.unv")
    write_modal_hdf5(modes, folder / "modes.h5")
    write_vtu(result.housing.surface, folder / "surface.vtu", cells={}, points={})
    named = ", ".join(f'{{ name = "{seat.name}", node = {seat.label} }}' for seat in seats[:2])
    for ending, surface in (("unv", "opening_mm = 50"), ("h5", 'surface = { file = "surface.vtu" }')):
        (folder / f"{ending}.toml").write_text(
            f'base = "case.toml"\nquantities = ["pressure"]\n[band]\nhigh = {MODAL_BAND}\n'
            f'[housing]\ntype = "modal_results"\nfile = "modes.{ending}"\nresidual_vectors = true\n{surface}\n'
            f"seats = [{named}]\nmounting_plane = {{ point = [0, 0, 0], normal = [0, 0, -1] }}\n"
        )
    return fidelity, result, folder


def decibels(second, first):
    """Difference of levels over the strong lines, and overall."""
    a, b = (np.abs(result.pressure.pressure) for result in (first, second))
    strong = a > a.max() / 30
    assert strong.sum() >= 4
    return np.abs(20 * np.log10(b[strong] / a[strong])).max(), abs(second.overall[0] - first.overall[0])


@pytest.mark.slow
def test_modal_results_with_residual_vectors_sound_as_the_solid_model(modal_results):
    """On the same radiating surface, to the digits of the file: the skin moves by the same parabolas."""
    fidelity, first, folder = modal_results
    case = nvh.load_case(folder / "h5.toml")
    assert isinstance(case.housing, ModalResults)
    preflight(case, fidelity)
    second = nvh.run(case, fidelity=fidelity, mesh_laws=first.mesh_laws)
    assert second.housing.natural_frequency == pytest.approx(first.housing.natural_frequency, rel=1e-11)
    assert len(first.housing.natural_frequency)
    largest = np.abs(first.housing.seat_residual).max()
    np.testing.assert_allclose(second.housing.seat_residual, first.housing.seat_residual, atol=1e-12 * largest)
    np.testing.assert_allclose(second.force_spectrum.force, first.force_spectrum.force, atol=1e-9 * 60.0)
    strong, overall = decibels(second, first)
    assert strong < 1e-9
    assert overall < 1e-9


@pytest.mark.slow
def test_modal_results_of_six_digits_on_their_own_envelope_sound_within_half_a_decibel(modal_results):
    """At strong lines, where the faces' shares cancel among them, and overall. What is seat is not known in modal
    results: bores are closed by their diameter alone, the envelope must not move with it."""
    fidelity, first, folder = modal_results
    case = nvh.load_case(folder / "unv.toml")
    given = {"bearing_forces": first.bearing_forces}
    second = nvh.run(case, fidelity=fidelity, **given)
    assert second.housing.natural_frequency == pytest.approx(first.housing.natural_frequency, rel=1e-5)
    largest = np.abs(first.housing.seat_residual).max()
    np.testing.assert_allclose(second.housing.seat_residual, first.housing.seat_residual, atol=2e-5 * largest)
    strong, overall = decibels(second, first)
    assert strong < 0.45  # 0.33 where modes beyond the band moved statically, in both housings
    assert overall < 0.15


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('file = "modes.h5"', "", "housing: required field 'file' is missing"),
        ("residual_vectors", "residual_vector", "unknown field; did you mean 'residual_vectors'"),
        ("residual_vectors = true", 'residual_vectors = "yes"', "must be of type bool"),
        ("residual_vectors = true", 'residual_vectors = true\nunits = "mm"', "units = 'mm': choose one of"),
        ("residual_vectors = true", "modal_damping = 0.7", r"modal_damping = 0\.7"),
        ('name = "A2"', 'name = "A1"', "seats: names must be distinct"),
    ],
)
def test_keys_of_modal_results_are_strict(modal_results, tmp_path, old, new, message):
    text = (modal_results[2] / "h5.toml").read_text().replace("case.toml", str(modal_results[2] / "case.toml"))
    assert old in text
    (tmp_path / "case.toml").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message):
        nvh.load_case(tmp_path / "case.toml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"units": "mm-t-s"}, "HDF5 is in SI, not in mm-t-s"),
        ({"file": "modes.xyz"}, r"\.xyz holds no modes: \.unv, "),
        ({"file": "none.h5"}, r"none\.h5"),
        ({"seats": (SeatNode("A1", 10**7),)}, r"bearing A1: .*modes\.h5 has no node 10000000"),
        ({"seats": (SeatNode("X", 1),)}, "seats are named for X, which are no bearings"),
        ({"surface": SurfaceFile("none.stl")}, r"none\.stl: no such surface file"),
    ],
)
def test_modal_results_that_do_not_fit_are_refused(modal_results, change, message):
    fidelity, first, folder = modal_results
    case = nvh.load_case(folder / "h5.toml")
    case = replace(case, housing=replace(case.housing, **change))
    with pytest.raises(InputError, match=message):
        nvh.run(case, fidelity=fidelity, bearing_forces=first.bearing_forces)


@pytest.mark.slow
def test_housing_that_is_handed_in_is_not_read_from_its_file(modal_results):
    fidelity, first, folder = modal_results
    case = nvh.load_case(folder / "case.toml")
    gone = replace(case, housing=replace(case.housing, file="gone.bdf"), quantities=("bearing_forces",))
    preflight(gone, fidelity, {"housing": first.housing})
    with pytest.raises(InputError, match=r"gone\.bdf"):
        preflight(gone, fidelity, {"mesh_laws": first.mesh_laws})


def test_case_says_which_constraints_hold_a_nastran_housing(folder, coarse):
    text = (folder / "housing.bdf").read_text().replace("SPC = 1", "$")
    (folder / "two.bdf").write_text(text.replace("ENDDATA", "SPC1    2       3       1\nENDDATA"))
    two = (folder / "case.toml").read_text().replace("housing.bdf", "two.bdf")
    (folder / "two.toml").write_text(two)
    with pytest.raises(InputError, match=r"two\.bdf: constraint sets 1, 2 are present: choose one by spc"):
        preflight(nvh.load_case(folder / "two.toml"), coarse)
    (folder / "one.toml").write_text(two.replace('"two.bdf"', '"two.bdf"\nspc = 1'))
    preflight(nvh.load_case(folder / "one.toml"), coarse)
    (folder / "none.toml").write_text(two.replace('"two.bdf"', '"two.bdf"\nspc = 3'))
    with pytest.raises(InputError, match=r"constraint set 3 is not there; known: \[1, 2\]"):
        preflight(nvh.load_case(folder / "none.toml"), coarse)


def test_missing_file_and_missing_seat_are_refused(folder, coarse):
    case = nvh.load_case(folder / "case.toml")
    with pytest.raises(InputError, match=r"none\.bdf: cannot be read"):
        nvh.run(replace(case, housing=replace(case.housing, file="none.bdf")), fidelity=coarse)
    bearing = replace(case.bearings[0], z=case.bearings[0].z + 1e-3)
    with pytest.raises(InputError, match=r"has no rigid set of .*housing\.bdf within 0\.1 mm"):
        nvh.run(replace(case, bearings=(bearing, *case.bearings[1:])), fidelity=coarse)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"housing.bdf"', '"nope.bdf"', "nope.bdf: cannot be read"),
        ('"mm-t-s"', '"m-kg-s"', "read in m-kg-s"),
        ('"housing.bdf"', '"free.bdf"', "nothing holds the housing, whose rigid motion no bearing takes"),
        (
            'units = "mm-t-s"',
            'units = "mm-t-s"\nseats = [{ name = "A1", nodes = "none" }]',
            "has no rigid set or node",
        ),
    ],
)
def test_check_and_plan_look_into_the_file_of_the_housing(folder, capsys, old, new, message):
    assert main(["check", str(folder / "case.toml")]) == 0
    text = (folder / "case.toml").read_text()
    assert old in text
    (folder / "looked_into.toml").write_text(text.replace(old, new))
    for command in ("check", "plan"):
        assert main([command, str(folder / "looked_into.toml")]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda file: file["labels"].write_direct(file["labels"][()] + 10**8), r"modes\.h5 has no node \d+"),
        (lambda file: file["shapes"].write_direct(0 * file["shapes"][()]), "moves in no mode"),
        (lambda file: file["frequency"].write_direct(file["frequency"][()] / 100), "its modes end at"),
        (
            lambda file: file["frequency"].write_direct(np.maximum(0, file["frequency"][()] - file["frequency"][0])),
            "has a rigid motion: nothing holds the housing, whose rigid motion no bearing takes",
        ),
    ],
)
def test_check_and_plan_look_for_the_seats_and_the_band_in_modal_results(
    modal_results, tmp_path, capsys, change, message
):
    folder = modal_results[2]
    assert main(["check", str(folder / "h5.toml")]) == 0
    shutil.copy(folder / "modes.h5", tmp_path)
    with h5py.File(tmp_path / "modes.h5", "a") as file:
        change(file)
    text = (folder / "h5.toml").read_text().replace("case.toml", str(folder / "case.toml"))
    (tmp_path / "case.toml").write_text(text)
    for command in ("check", "plan"):
        assert main([command, str(tmp_path / "case.toml")]) == 2
        assert re.search(message, capsys.readouterr().err)


def test_free_housing_takes_given_forces(folder, coarse):
    (folder / "free.toml").write_text((folder / "case.toml").read_text().replace('"housing.bdf"', '"free.bdf"'))
    preflight(nvh.load_case(folder / "free.toml"), coarse, {"bearing_forces"})
