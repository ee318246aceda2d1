"""Craig–Bampton matrices of a case's housing in the files of other programs."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from scipy.io import loadmat

import nvhchain as nvh
from nvhchain import cli
from nvhchain.case import HousingModel
from nvhchain.errors import AccuracyWarning, InputError
from nvhchain.housing import reduce_housing
from nvhchain.housing.casting.mesh import mesh_casting
from nvhchain.interop import write_craig_bampton, write_nastran
from nvhchain.report import export_craig_bampton
from tests.housing.casting_model import casting_model
from tests.housing.seat_motion import seat_flexibility


@pytest.fixture(scope="module")
def small(request):
    """The small gearbox and its case file."""
    path = request.config.rootpath / "cases/small/single_stage.toml"
    found = nvh.load_case(path)
    return path, replace(found, band=replace(found.band, high=1900.0))


@pytest.fixture(scope="module", autouse=True)
def mesh(small, coarse):
    """The casting is meshed once for all tests."""
    made = mesh_casting(small[1].housing, coarse.housing)
    with pytest.MonkeyPatch.context() as patch:
        for module in ("exchange.craig_bampton", "reduction"):
            patch.setattr(sys.modules[f"nvhchain.housing.{module}"], "mesh_casting", lambda *_: made)
        yield made


@pytest.fixture(scope="module")
def exchange(small, coarse, tmp_path_factory):
    folder = tmp_path_factory.mktemp("exchange")
    made = export_craig_bampton(small[1], folder / "housing.bdf", fidelity=coarse, modes_to=8e3)
    write_craig_bampton(made, folder / "housing.mat")
    return folder, made


def dmig(path, name):
    """A symmetric matrix from bulk data, with the (grid, component) of its rows."""
    entries, column, size = {}, None, set()
    for line in path.read_text().splitlines():
        fields = [line[i : i + 16].strip() for i in range(8, len(line), 16)]
        if line.startswith("DMIG*"):
            column = (int(fields[1]), int(fields[2])) if fields[0] == name else None
        elif line.startswith("*") and column is not None and len(fields) == 3:
            row = int(fields[0]), int(fields[1])
            entries[row, column] = entries[column, row] = float(fields[2].replace("D", "E"))
            size |= {row, column}
    order = sorted(size)
    return np.array([[entries.get((row, column), 0.0) for column in order] for row in order]), order


@pytest.mark.slow
def test_bulk_data_hold_the_matrices_to_ten_digits(exchange, small):
    folder, made = exchange
    seats, modes = len(made.names), len(made.interface_frequency)
    assert modes > 5
    for name, exact in (("KHOUSE", made.stiffness), ("MHOUSE", made.mass)):
        matrix, order = dmig(folder / "housing.bdf", name)
        assert order == [(g, c) for g in range(1, seats + 1) for c in range(1, 7)] + [
            (seats + i, 0) for i in range(1, modes + 1)
        ]
        scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
        assert np.abs((matrix - exact) / scale).max() < 1e-9
        assert f"DMIG    {name:8}       0       6       2       0" in (folder / "housing.bdf").read_text()
    text = (folder / "housing.bdf").read_text().splitlines()
    place = next(i for i, line in enumerate(text) if line == f"$ seat {made.names[1]}")
    x, y, z = small[1].seats[made.names[1]]
    numbers = [float(text[place + 1][i : i + 16]) for i in (40, 56)] + [float(text[place + 2][8:24])]
    assert numbers == pytest.approx([x, y, z], abs=1e-15)
    assert f"SPOINT  {seats + 1:8d}THRU    {seats + modes:8d}" in text


@pytest.mark.slow
def test_matrices_have_the_static_flexibility_and_the_modes_of_the_reduction(exchange, small, coarse):
    folder, made = exchange
    mat = loadmat(folder / "housing.mat")
    K, M = mat["stiffness"], mat["mass"]
    assert np.array_equal(K, made.stiffness)
    assert [str(name[0]) for name in mat["names"].ravel()] == list(made.names)
    seats = 6 * len(made.names)
    at = np.concatenate([6 * seat + np.arange(3) for seat in range(len(made.names))])
    plain = replace(coarse.housing, corrected_frequencies=False)  # as other programs find them of the matrices
    with pytest.warns(AccuracyWarning, match="housing elements of 40 mm"):
        reduced = reduce_housing(small[1].housing, f_max=1900.0, surface_size=0.05, fidelity=plain)
    exact = seat_flexibility(reduced)
    flexibility = np.linalg.inv(K[:seats, :seats])[np.ix_(at, at)]
    assert np.abs(flexibility - exact).max() < 1e-7 * np.abs(exact).max()
    lowest = np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)[0]) / (2 * np.pi)
    (first, *_) = reduced.natural_frequency
    assert 0 <= lowest / first - 1 < 0.01


@pytest.mark.slow
def test_model_from_a_file_gives_the_matrices_of_the_casting(exchange, small, mesh, coarse, tmp_path):
    write_nastran(casting_model(mesh, small[1].housing), tmp_path / "housing.bdf", units="mm-t-s")
    foreign = replace(small[1], housing=HousingModel("housing.bdf", "mm-t-s"), folder=str(tmp_path))
    made = export_craig_bampton(foreign, tmp_path / "housing.mat", fidelity=coarse, modes_to=8e3)
    exact = exchange[1]
    assert made.interface_frequency == pytest.approx(exact.interface_frequency, rel=1e-7)
    seats = exact.seats
    for one, other in ((made.stiffness, exact.stiffness), (made.mass, exact.mass)):
        scale = np.sqrt(np.outer(np.diag(other), np.diag(other)))[seats, seats]
        assert np.abs((one - other)[seats, seats] / scale).max() < 1e-6


@pytest.mark.slow
def test_command_writes_the_file_and_refuses_what_it_cannot(small, coarse, tmp_path, capsys, monkeypatch):
    (tmp_path / "case.toml").write_text(f'base = "{small[0]}"\n[band]\nhigh = 1900\n')
    monkeypatch.setitem(cli.commands.PRESETS, "draft", coarse)
    words = ["craig-bampton", str(tmp_path / "case.toml"), "--fidelity", "draft", "--out"]
    assert cli.main([*words, str(tmp_path / "h.mat"), "--modes-to", "2000"]) == 0
    assert capsys.readouterr().out.endswith("h.mat: 4 seats, 0 modes\n")
    assert cli.main([*words, str(tmp_path / "h.op2"), "--modes-to", "2000"]) == 2
    assert "written as .mat or .bdf" in capsys.readouterr().err
    assert cli.main([*words, str(tmp_path / "i.mat"), "--modes-to", "500"]) == 2
    assert "must lie between the band's upper limit of 1900 Hz and 20 times that" in capsys.readouterr().err
    assert not (tmp_path / "i.mat").exists()
    sphere = nvh.load_case(small[0].parents[1] / "sphere/pulsating.toml")
    with pytest.raises(InputError, match="has no housing"):
        export_craig_bampton(sphere, tmp_path / "s.mat", modes_to=1e4)
