"""Parts of the estimates that are kept with the operators."""

from dataclasses import replace

import pytest

import nvhchain as nvh
from nvhchain import gear
from nvhchain.case import AUTO, PLAIN
from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.report import write_page
from nvhchain.scene import linear_level, modelled
from nvhchain.scene.kept import ESTIMATES, estimates_kept


@pytest.fixture
def turning(request):
    """The small gearbox, its friction open, at a speed of the input (rad/s)."""
    case = nvh.load_case(request.config.rootpath / "cases/small/single_stage.toml")
    open_case = replace(case, options=replace(PLAIN, friction=AUTO))
    return lambda speed: replace(open_case, operation=replace(case.operation, input_speed=speed))


@pytest.fixture
def computed(monkeypatch):
    """Numbers of mesh periods that are computed; nothing is remembered from tests before."""
    found = []

    def mesh_period(*arguments, **others):
        found.append(arguments)
        return gear.mesh_period(*arguments, **others)

    class Gear:
        def __getattr__(self, name):
            return mesh_period if name == "mesh_period" else getattr(gear, name)

    monkeypatch.setattr(linear_level, "gear", Gear())
    return found


def forgotten():
    linear_level._period.cache_clear()


def test_another_speed_computes_no_mesh_period_again_and_decides_alike(computed, turning, tmp_path):
    folder = tmp_path / "operators"
    folder.mkdir()
    forgotten()
    with estimates_kept(folder):
        modelled(turning(151.0), nvh.DRAFT)
    assert computed
    computed.clear()
    forgotten()
    with estimates_kept(folder):
        kept = modelled(turning(153.0), nvh.DRAFT)
    assert not computed
    forgotten()
    assert modelled(turning(153.0 * (1 + 1e-15)), nvh.DRAFT).options == kept.options


def test_before_the_folder_exists_estimates_wait_for_the_end(computed, turning, tmp_path):
    folder = tmp_path / "operators"
    forgotten()
    with estimates_kept(folder):
        modelled(turning(155.0), nvh.DRAFT)
        assert not folder.exists()
        folder.mkdir()
    assert list((folder / ESTIMATES).glob("mesh_period-*.h5"))


def test_an_interruption_keeps_what_was_computed_and_a_full_disk_stops_nothing(computed, turning, tmp_path, caplog):
    folder = tmp_path / "operators"
    folder.mkdir()
    forgotten()
    with pytest.raises(KeyboardInterrupt), estimates_kept(folder):
        interrupted(turning(156.0))
    assert list((folder / ESTIMATES).glob("mesh_period-*.h5"))
    (other := tmp_path / "other").mkdir()
    (other / ESTIMATES).write_text("a file where the folder should be")
    forgotten()
    with estimates_kept(other):
        modelled(turning(156.5), nvh.DRAFT)
    assert "estimates are not kept" in caplog.text


def interrupted(case):
    modelled(case, nvh.DRAFT)
    raise KeyboardInterrupt


def test_a_folder_of_estimates_is_no_run(computed, turning, tmp_path):
    forgotten()
    with estimates_kept(tmp_path):
        modelled(turning(158.0), nvh.DRAFT)
    with pytest.raises(InputError, match="holds no results"):
        write_page(tmp_path)


def test_a_case_that_is_refused_leaves_no_folder(turning, tmp_path):
    folder = tmp_path / "operators"
    forgotten()
    with pytest.raises(InputError):
        refused(folder, turning(157.0))
    assert not folder.exists()


def refused(folder, case):
    with estimates_kept(folder):
        modelled(case, nvh.DRAFT)
        raise InputError("refused")


@pytest.mark.slow
def test_a_command_keeps_them_beside_its_operators_and_the_next_one_reads_them(request, tmp_path, capsys):
    case = str(request.config.rootpath / "cases/small/single_stage.toml")
    words = ["--fidelity", "draft", "--out", str(tmp_path / "out"), "--set", 'quantities=["bearing_forces"]']
    forgotten()
    assert main(["run", case, *words, "--set", "operation.input_speed_rpm=1700"]) == 0
    made = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "estimates").iterdir()}
    assert made
    forgotten()
    assert main(["run", case, *words, "--set", "operation.input_speed_rpm=1710"]) == 0
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "estimates").iterdir()} == made
