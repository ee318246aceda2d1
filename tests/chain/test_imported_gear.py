"""A gear meshed by another program takes the place of a drawn one in a case."""

from dataclasses import replace

import meshio
import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Mesh
from nvhchain.chain import steps
from nvhchain.chain.running import Run
from nvhchain.errors import InputError
from nvhchain.fidelity import GearFidelity
from nvhchain.files.result_cache import fingerprint
from nvhchain.gear import mass_properties, whole_mesh
from nvhchain.scene import Scene, preflight

pytestmark = pytest.mark.filterwarnings("ignore:housing elements of")  # models are coarse on purpose


GEAR = GearFidelity(
    profile_elements=2,
    width_layers=2,
    slices=6,
    angles_per_mesh=6,
    deflections_per_doubling=2,
    row_aspect=2.5,
    load_pattern_tolerance=1e-6,
    far_pattern_tolerance=0.0,
)


@pytest.fixture(scope="module")
def fidelity(coarse):
    return replace(coarse, gear=GEAR)


@pytest.fixture(scope="module")
def folder(request, tmp_path_factory):
    """A case of the small gearbox whose wheel stands beside it as bricks in millimetres, its tags named otherwise."""
    folder = tmp_path_factory.mktemp("gear")
    base = request.config.rootpath / "cases/small/single_stage.toml"
    body = nvh.load_case(base).gears[1].body
    write(folder / "wheel.inp", whole_mesh(body, GEAR))
    (folder / "case.toml").write_text(
        f'base = "{base}"\n[band]\nhigh = 1500\n[[gears]]\nname = "wheel"\n'
        '[gears.blank]\ntype = "mesh"\nfile = "wheel.inp"\nunits = "mm"\nbore = "shaft seat"\nflanks = "Flanks"\n'
        "symmetry = 30\n"
    )
    return folder


def write(path, mesh, stretch=1.0):
    tags = {"shaft seat": mesh.bore, "FLANKS": mesh.flanks}
    nodes = 1e3 * mesh.nodes * [1.0, 1.0, stretch]
    meshio.Mesh(nodes, [("hexahedron20", mesh.elements)], point_sets=tags).write(path)


@pytest.mark.slow
def test_case_with_a_meshed_wheel_has_the_mesh_law_and_inertia_of_the_drawn_one(request, folder, fidelity):
    foreign = nvh.load_case(folder / "case.toml")
    assert isinstance(foreign.gears[1].blank, Mesh)
    preflight(foreign, fidelity)
    assert "30 teeth volumemesh (1 by symmetry)" in str(nvh.plan(foreign, fidelity=fidelity))
    own = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    own = replace(own, operation=foreign.operation, band=foreign.band)  # slow speeds have finer laws
    laws, masses = [], []
    for case in (own, foreign):
        laws.append(steps.mesh_laws(Run(Scene(case, fidelity)))[0])
        masses.append(mass_properties(case.gears[1].body))
    np.testing.assert_allclose(laws[1].force, laws[0].force, atol=5e-3 * np.abs(laws[0].force).max())
    np.testing.assert_allclose(masses[1][:3], masses[0][:3], rtol=2e-3)


def test_what_the_file_says_is_in_the_key_of_the_mesh_law(folder):
    case = nvh.load_case(folder / "case.toml")
    keys = []
    for stretch in (1.0, 1.0, 0.99):
        write(folder / "wheel.inp", case.gears[1].body.blank, stretch)
        keys.append(fingerprint(nvh.load_case(folder / "case.toml").pairs[0]))
    write(folder / "wheel.inp", case.gears[1].body.blank)
    assert keys[1] == keys[0]
    assert keys[2] != keys[0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('units = "mm"', 'units = "cm"', r"gears\[1\] \(wheel\).blank.units = 'cm': choose one of 'm', 'mm', 'in'"),
        ('units = "mm"\n', "", r"gears\[1\] \(wheel\).blank: required field 'units' is missing"),
        ('units = "mm"', 'units = "m"', r"gears\[1\] \(wheel\): the mesh reaches to r = 4.* m, the drawn tip circle"),
        ('"wheel.inp"', '"none.inp"', r"none.inp: cannot be read \(No such file or directory\)"),
        ('"wheel.inp"', "3", r"gears\[1\] \(wheel\).blank.file = 3 must be of type str"),
        ('bore = "shaft seat"', 'bore = "Bore"', r"no tag 'Bore' among flanks, shaft seat: name the nodes of the bore"),
        ('bore = "shaft seat"', 'bore = "Flanks"', r"bore and flanks are both 'Flanks': name two tags"),
        ("symmetry = 30", "symmetry = 0", r"symmetry = 0 must be at least 1"),
        ("symmetry = 30", "slots = 3", r"gears\[1\] \(wheel\).blank.slots: unknown field"),
    ],
)
def test_meshes_of_a_case_that_cannot_be_used_are_refused_with_the_field(folder, old, new, message):
    text = (folder / "case.toml").read_text()
    assert old in text
    (folder / "changed.toml").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message):
        nvh.load_case(folder / "changed.toml")
