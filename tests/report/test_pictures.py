"""What a comparison left can be drawn again, file by file."""

import pytest
from matplotlib.image import imread

from nvhchain.cli import main


@pytest.fixture
def drawn(tmp_path, capsys):
    """Draw files; the picture (rows, columns, colours)."""

    def draw(*files, arguments=()):
        picture = tmp_path / "picture.png"
        assert main(["plot", *map(str, files), "--out", str(picture), *arguments]) == 0
        assert capsys.readouterr().out.strip() == str(picture)
        return imread(picture)

    return draw


@pytest.mark.parametrize("name", ["bearing_forces", "force_spectrum", "pressure"])
def test_one_kind_of_both_configurations_goes_into_one_figure(compared, drawn, name):
    one = drawn(compared[0] / "solid" / f"{name}.h5")
    both = drawn(*(compared[0] / case / f"{name}.h5" for case in ("solid", "slotted")))
    assert one.std() > 0.01
    assert both.std() != one.std()


def test_a_mesh_law_is_a_map_and_several_are_transmission_errors(compared, drawn):
    first, second, *_ = sorted((compared[0] / "operators").glob("mesh_law_stage1-*.h5"))  # maps leave more of them
    assert drawn(first).shape != drawn(first, second).shape


@pytest.mark.slow
def test_surface_velocity_is_a_picture_of_the_housing(compared, drawn):
    assert drawn(compared[0] / "slotted" / "surface_velocity.h5").std() > 0.01


@pytest.mark.slow
def test_modes_and_operating_shapes_are_drawn_and_exported(compared, drawn, tmp_path, capsys):
    solid = compared[0] / "solid"
    housing = next((compared[0] / "operators").glob("housing-*.h5"))
    velocity = compared[0] / "slotted" / "surface_velocity.h5"
    assert drawn(housing).std() > 0.01
    for source, name in (
        (velocity, "a.gif"),
        (velocity, "a.vtkhdf"),
        (housing, "b.vtkhdf"),
        (housing, "b.gif"),
        (housing, "b.unv"),
    ):
        assert main(["plot", str(source), "--out", str(tmp_path / name)]) == 0
        assert (tmp_path / name).stat().st_size > 10_000
    assert main(["plot", str(solid / "pressure.h5"), "--out", str(tmp_path / "c.gif")]) == 2
    assert "does not go into c.gif" in capsys.readouterr().err


def test_what_does_not_go_into_one_figure_is_refused(compared, tmp_path, capsys):
    solid = compared[0] / "solid"
    for files, reason in (
        ([solid / "pressure.h5", solid / "force_spectrum.h5"], "do not go into one figure"),
        (list((compared[0] / "operators").glob("transfer_vectors-*.h5")), "TransferVectors has no figure"),
        ([tmp_path / "none.h5"], "no such file"),
    ):
        assert main(["plot", *map(str, files), "--out", str(tmp_path / "p.png")]) == 2
        assert reason in capsys.readouterr().err
    assert not (tmp_path / "p.png").exists()
