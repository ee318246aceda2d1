"""A housing from another program's file takes the place of the casting."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import HousingModel
from nvhchain.errors import InputError
from nvhchain.fidelity import HousingFidelity
from nvhchain.housing.casting_model import casting_model
from nvhchain.housing.mesh import mesh_casting
from nvhchain.interop import write_nastran
from nvhchain.scene import preflight

FIDELITY = HousingFidelity(element_size=0.02, elements_per_turn=10)


@pytest.fixture(scope="module")
def folder(request, tmp_path_factory):
    """A case file of the small gearbox whose casting stands beside it as Nastran bulk data in millimetres."""
    folder = tmp_path_factory.mktemp("foreign")
    base = request.config.rootpath / "cases/small/single_stage.toml"
    casting = nvh.load_case(base).housing
    write_nastran(casting_model(mesh_casting(casting, FIDELITY), casting), folder / "housing.bdf", units="mm-t-s")
    (folder / "case.toml").write_text(
        f'base = "{base}"\nquantities = ["surface_velocity"]\n[band]\nhigh = 1500\n'
        '[housing]\ntype = "housing_model"\nfile = "housing.bdf"\nunits = "mm-t-s"\n'
        "engine_plane = { point = [0, 0, 0], normal = [0, 0, -1] }\n"
    )
    return folder


def test_gearbox_in_a_foreign_housing_moves_like_in_the_casting(request, folder, coarse):
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


def test_missing_file_and_missing_seat_are_refused(folder, coarse):
    case = nvh.load_case(folder / "case.toml")
    with pytest.raises(InputError, match=r"none\.bdf: cannot be read"):
        nvh.run(replace(case, housing=replace(case.housing, file="none.bdf")), fidelity=coarse)
    bearing = replace(case.bearings[0], z=case.bearings[0].z + 1e-3)
    with pytest.raises(InputError, match=r"has no rigid set of .*housing\.bdf within 0\.1 mm"):
        nvh.run(replace(case, bearings=(bearing, *case.bearings[1:])), fidelity=coarse)
