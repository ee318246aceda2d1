"""What modes and panels contribute, pictures and tables of modes: from a case and from the command line."""

import csv
import json
from dataclasses import replace

import meshio
import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

import nvhchain as nvh
from nvhchain.case import HousingModel, ModalResults
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import ForceSpectrum
from nvhchain.housing import exported_modes
from nvhchain.interop import write_modal_uff
from nvhchain.report import contributions
from nvhchain.report.stored import stored_results

pytestmark = pytest.mark.filterwarnings(
    "ignore:housing elements of", "ignore:the parts of the motion cancel"
)  # models are coarse on purpose


@pytest.fixture(scope="module")
def fidelity(coarse):
    return replace(coarse, housing=replace(coarse.housing, element_size=0.035, mode_ratio=2.0))


@pytest.fixture(scope="module")
def case(request):
    found = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    return replace(found, band=replace(found.band, low=150.0, high=2000.0))


@pytest.fixture(scope="module")
def load():
    lines = np.array([200.0, 1300.0, 1900.0])
    rng = np.random.default_rng(4)
    force = rng.standard_normal((3, 4, 3)) + 1j * rng.standard_normal((3, 4, 3))
    return ForceSpectrum(lines, force, ("A1", "A2", "B1", "B2"))


@pytest.fixture(scope="module")
def told(case, load, fidelity, tmp_path_factory):
    out = tmp_path_factory.mktemp("parts")
    return out, contributions(case, fidelity=fidelity, out=out, supplied={"force_spectrum": load})


def rows(path):
    with path.open(newline="") as file:
        return list(csv.reader(file))


@pytest.mark.slow
def test_shares_of_modes_and_panels_add_up_to_the_pressure_at_every_line(told, case):
    out, _ = told
    pressure = hdf5.load(out / "pressure.h5")
    for kind in ("modes", "panels"):
        head, *lines = rows(out / f"contributions-{kind}.csv")
        assert head[:3] == ["field point", "frequency / Hz", "level / dB"]
        assert len(lines) == pressure.pressure.size
        points = [point.name for point in case.field_points]
        for name, frequency, level, *shares in lines:
            where = points.index(name), int(np.abs(pressure.frequency - float(frequency)).argmin())
            exact = 20 * np.log10(np.abs(pressure.pressure[where[1], where[0]]) / np.sqrt(2) / 20e-6)
            assert float(level) == pytest.approx(exact, abs=0.05)
            assert sum(map(float, shares)) == pytest.approx(1.0, abs=1e-3)
        assert imread(out / f"contributions-{kind}.png").std() > 0.01
    assert stored_results(out).finished  # its page has level and limits
    assert head[3:8] == ["side wall +x", "side wall -x", "side wall +y", "side wall -y", "rear wall"]
    assert head[-2:] == ["boss A2", "boss B2"]


def test_command_finds_the_run_and_draws_the_line_it_is_asked_for(told, case, load, request, capsys, tmp_path):
    hdf5.save(load, tmp_path / "forces.h5")
    base = request.config.rootpath / "cases/small/single_stage.toml"
    (tmp_path / "case.toml").write_text(f'base = "{base}"\n[band]\nlow = 150\nhigh = 2000\n')
    command = ["contributions", str(tmp_path / "case.toml"), "--fidelity", "draft", "--out", str(tmp_path / "out")]
    for made in (tmp_path / "forces.h5", *told[0].glob("housing-*.h5"), *told[0].glob("transfer_vectors-*.h5")):
        command += ["--use", str(made)]
    assert main([*command, "--at", "1250"]) == 0
    made = capsys.readouterr().out.split("\n")[:-1]
    assert made == [str(tmp_path / "out" / f"contributions-{kind}.csv") for kind in ("paths", "modes", "panels")]
    assert main([*command, "--at", "190"]) == 2
    assert "at = 190 Hz: the lines lie between 200 and 1900 Hz" in capsys.readouterr().err


def test_the_summary_of_the_folder_is_that_of_the_case_and_its_forces(told, case, load, fidelity, tmp_path):
    operators = {name: hdf5.load(next(told[0].glob(f"{name}-*.h5"))) for name in ("housing", "transfer_vectors")}

    def configurations(of, forces):
        contributions(of, fidelity=fidelity, out=tmp_path, supplied=operators | {"force_spectrum": forces})
        return json.loads((tmp_path / "summary.json").read_text())["configurations"]

    first = configurations(case, load)[case.name]["overall_dBA"]
    whole = (tmp_path / "summary.json").stat().st_mtime_ns
    configurations(case, load)
    assert (tmp_path / "summary.json").stat().st_mtime_ns == whole  # what else it holds is kept
    louder = load.replace(force=2 * load.force)
    assert configurations(case, louder)[case.name]["overall_dBA"] == pytest.approx(first + 20 * np.log10(2), abs=1e-6)
    assert list(configurations(replace(case, name="other"), louder)) == ["other"]


def test_what_has_no_contributions_is_refused(case, fidelity, request, tmp_path):
    folder = request.config.rootpath / "cases"
    loud = replace(fidelity, acoustics=replace(fidelity.acoustics, radiation="equivalent_radiated_power"))
    for odd, level, message in (
        (nvh.load_case(folder / "sphere/pulsating.toml"), fidelity, "has no housing"),
        (replace(case, quantities=("surface_velocity",)), fidelity, "does not ask for `pressure`"),
        (case, loud, "has no phase"),
    ):
        with pytest.raises(InputError, match=message):
            contributions(odd, fidelity=level, out=tmp_path)
    with pytest.raises(InputError, match="has constant speed"):
        contributions(case, fidelity=fidelity, order=20.0, out=tmp_path)
    rising = nvh.load_case(folder / "gearbox/run_up_solid.toml")
    with pytest.raises(InputError, match=r"order = -1\.0: give an order"):
        contributions(rising, fidelity=fidelity, order=-1.0, out=tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.fixture
def plot(tmp_path, capsys):
    """Run `nvhchain plot`; the file, or the line of refusal."""

    def run(name, *files, at=()):
        path = tmp_path / name
        words = ["plot", *map(str, files), "--out", str(path), *(("--at", *map(str, at)) if at else ())]
        code = main(words)
        captured = capsys.readouterr()
        assert path.exists() is (code == 0)
        return path if code == 0 else captured.err

    return run


@pytest.fixture(scope="module")
def files(told):
    out, _ = told
    (housing,) = out.glob("housing-*.h5")
    return housing, out / "surface_velocity.h5"


@pytest.mark.slow
def test_mode_and_line_nearest_to_a_frequency_are_drawn_and_moved(files, plot):
    housing, velocity = files
    natural = hdf5.load(housing).natural_frequency.tolist()
    pictures = [imread(plot(f"{i}.png", housing, at=at)) for i, at in enumerate(([], natural[:2], natural[:1]))]
    assert len({picture.tobytes() for picture in pictures}) == 3
    assert imread(plot("c.png", velocity, at=[1300])).std() > 0.01
    first, second = (plot(f"{i}.gif", housing, at=[natural[i]]).read_bytes() for i in (0, 1))
    assert first != second
    assert first == plot("d.gif", housing).read_bytes()
    with Image.open(plot("e.gif", velocity, at=[200])) as moving:
        assert moving.n_frames == 24


def test_one_state_is_written_for_paraview(files, plot):
    housing, velocity = (hdf5.load(path) for path in files)
    mesh = meshio.read(plot("mode.vtu", files[0], at=[housing.natural_frequency[1]]))
    assert mesh.cell_data["normal_shape"][0] == pytest.approx(housing.normal_shapes[1])
    assert mesh.point_data["motion"].shape == (len(housing.surface.vertices), 3)
    mesh = meshio.read(plot("line.vtu", files[1], at=[1310]))
    state = mesh.cell_data["normal_velocity_real"][0] + 1j * mesh.cell_data["normal_velocity_imaginary"][0]
    assert state == pytest.approx(velocity.normal_velocity[1])


def test_two_housings_give_their_modal_assurance(files, plot, tmp_path):
    housing = hdf5.load(files[0])
    housing = housing.drop_ritz_vectors()
    order = np.arange(housing.mode_count)
    order[:2] = 1, 0
    swapped = housing.replace(normal_shapes=-2 * housing.normal_shapes[order])
    hdf5.save(swapped, tmp_path / "swapped.h5")
    assert imread(plot("mac.png", files[0], tmp_path / "swapped.h5")).std() > 0.01
    head, *lines = rows(plot("mac.csv", files[0], tmp_path / "swapped.h5"))
    table = np.array([line[1:] for line in lines], dtype=float)
    assert [float(f) for f in head[1:]] == pytest.approx(housing.natural_frequency, rel=1e-5)
    assert table[order, np.arange(len(order))] == pytest.approx(np.ones(len(order)))
    assert table[0, 0] < 0.9
    head, *lines = rows(plot("own.csv", files[0], files[0]))
    own = np.array([line[1:] for line in lines], dtype=float)
    assert own.diagonal() == pytest.approx(np.ones(len(order)))
    assert head[0] == f"MAC of 1: {files[0]} (rows) and 2: {files[0]}, Hz"


@pytest.mark.parametrize(
    ("name", "which", "at", "message"),
    [
        ("a.csv", (0,), [], "two for their modal assurance"),
        ("a.csv", (0, 1), [], "do not go into one figure"),
        ("a.vtkhdf", (0,), [500], "all modes or lines"),
        ("a.gif", (0,), [500, 600], "2 frequencies are given"),
        ("a.gif", (0,), [1e6], "modes or lines lie between"),
        ("a.vtu", (1,), [-1], "modes or lines lie between"),
        ("a.png", (2,), [500], "is drawn whole"),
        ("a.gif", (2,), [], "choose a PNG"),
    ],
)
def test_what_cannot_be_drawn_is_refused(files, told, plot, name, which, at, message):
    every = (*files, told[0] / "pressure.h5")
    assert message in plot(name, *(every[i] for i in which), at=at)


@pytest.mark.slow
def test_groups_of_an_imported_model_are_its_panels(case, told, tmp_path):
    from nvhchain.fidelity import HousingFidelity
    from nvhchain.housing.casting.mesh import mesh_casting
    from nvhchain.interop import write_nastran
    from tests.housing.casting_model import casting_model

    mesh = mesh_casting(case.housing, HousingFidelity(element_size=0.04, elements_per_turn=10))
    write_nastran(casting_model(mesh, case.housing), tmp_path / "housing.bdf", units="mm-t-s")
    foreign = replace(case, housing=HousingModel("housing.bdf", "mm-t-s"), folder=str(tmp_path))
    surface = told[1]["panels"] and hdf5.load(told[0] / "surface_velocity.h5").surface
    panels = foreign.housing.panels(foreign, surface)
    assert "SKIN" in panels.names
    assert len(np.unique(panels.part)) > 1
    model = exported_modes(hdf5.load(next(told[0].glob("housing-*.h5"))))
    ends = {
        name: np.flatnonzero(np.abs(model.nodes[:, 2] - z) < 1e-3)
        for name, z in (("rear", case.housing.depth), ("flange", 0.0))
    }
    beside = np.setdiff1d(np.arange(len(model.nodes)), model.triangles)  # the seats, which are not on the skin
    assert len(beside) == 4
    groups = {**ends, "flange": np.concatenate([ends["flange"], beside]), "beside": beside}
    write_modal_uff(replace(model, groups=groups), tmp_path / "modes.unv")
    modal = ModalResults("modes.unv").panels(foreign, surface)
    assert set(modal.names) == {"flange", "rear"}
    rear = surface.centroids[:, 2] > 0.6 * case.housing.depth
    assert (np.array(modal.names)[modal.part[rear]] == "rear").all()
