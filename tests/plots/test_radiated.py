"""Polar diagrams show the directivity they are given, at the angles of the field points."""

import numpy as np
import pytest

from nvhchain.cli import main
from nvhchain.errors import InputError
from nvhchain.files import hdf5
from nvhchain.handoff import Directivity
from nvhchain.plots import directivity_polar

LINES = np.array([200.0, 400.0, 800.0])


def dipole(normal, count=24, turn=360.0):
    """3 cos² θ of a dipole along the first axis in the plane, at points on a circle of 2 m about (1, 2, 3) m."""
    angle = np.radians(turn) * np.arange(count) / (count if turn == 360.0 else count - 1)
    u, v = np.eye(3)[(normal + 1) % 3], np.eye(3)[(normal + 2) % 3]
    points = np.array([1.0, 2.0, 3.0]) + 2.0 * (np.outer(np.cos(angle), u) + np.outer(np.sin(angle), v))
    index = 10 * np.log10(3 * np.cos(angle) ** 2 + 1e-4)
    return angle, Directivity(LINES, points, np.array([index, index - 1.0, index - 2.0]))


@pytest.mark.parametrize(("normal", "names"), [(0, "yz"), (1, "zx"), (2, "xy")])
def test_polar_diagram_shows_the_index_over_the_angle_from_a_coordinate_axis(normal, names):
    angle, found = dipole(normal)
    mixed = np.random.default_rng(1).permutation(len(angle))
    ax = directivity_polar(
        {"a": found.replace(points=found.points[mixed], index=found.index[:, mixed])}, [390.0, 900.0]
    )
    assert [line.get_label() for line in ax.lines] == ["400 Hz", "800 Hz"]
    for line, index in zip(ax.lines, found.index[1:], strict=True):
        at, shown = line.get_data()
        assert at[-1] - at[0] == pytest.approx(2 * np.pi)  # closed
        order = np.argsort(at[:-1] % (2 * np.pi) % (2 * np.pi - 1e-9))
        assert np.sort(at[:-1] % (2 * np.pi - 1e-9)) == pytest.approx(angle, abs=1e-6)
        assert shown[:-1][order] == pytest.approx(index)
    assert ax.get_rmax() - ax.get_rmin() == pytest.approx(30.0)
    assert [label.get_text() for label in ax.get_xticklabels()][:4:3] == [f"{names[0]} 0°", f"{names[1]} 90°"]


def test_half_a_circle_stays_open_and_points_off_a_circle_are_refused():
    _, half = dipole(2, turn=180.0)
    ax = directivity_polar({"a": half, "b": half}, [200.0])
    assert [line.get_label() for line in ax.lines] == ["a, 200 Hz", "b, 200 Hz"]
    at, _ = ax.lines[0].get_data()
    assert at[-1] - at[0] == pytest.approx(np.pi)
    _, few = dipole(2, count=5)
    with pytest.raises(InputError, match="5 field points make no polar diagram"):
        directivity_polar({"a": few}, [200.0])
    moved = half.points.copy()
    moved[3] += [0.0, 0.0, 0.2]
    with pytest.raises(InputError, match=r"lie up to .* m from a circle of 2 m, 0.02 m are admitted"):
        directivity_polar({"a": half.replace(points=moved)}, [200.0])
    with pytest.raises(InputError, match="lie on a line"):
        directivity_polar({"a": half.replace(points=np.linspace([0, 0, 1], [0, 0, 2], 24))}, [200.0])
    with pytest.raises(InputError, match="different field points"):
        directivity_polar({"a": half, "b": half.replace(points=moved)}, [200.0])


def test_plot_with_a_frequency_draws_the_polar_diagram(tmp_path):
    hdf5.save(dipole(2)[1], tmp_path / "directivity.h5")
    assert main(["plot", str(tmp_path / "directivity.h5"), "--at", "200", "800", "--out", str(tmp_path / "p.png")]) == 0
    assert (tmp_path / "p.png").stat().st_size > 20_000
