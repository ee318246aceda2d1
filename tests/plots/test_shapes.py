"""Pictures of modes and operating shapes, their animation, tables of assurance and contributions."""

import numpy as np
import pytest
from PIL import Image

from nvhchain.errors import InputError
from nvhchain.handoff import ReducedHousing
from nvhchain.plots.bodies import _pyvista, shapes
from nvhchain.plots.bodies.scene import View
from nvhchain.plots.bodies.shapes import animate, mode_shapes, operating_shape
from nvhchain.plots.contributions import contribution_bars, modal_assurance_table


@pytest.fixture(scope="module")
def housing(housing_velocity):
    surface = housing_velocity.surface
    x, y, z = surface.centroids.T
    normal_shapes = np.array([x / 0.2, np.sin(12 * y) * (z > 0), z * x])
    return ReducedHousing(
        natural_frequency=np.array([500.0, 820.0, 990.0]),
        modal_damping=np.full(3, 0.02),
        seat_shapes=np.zeros((3, 1, 3)),
        normal_shapes=normal_shapes,
        seat_residual=np.zeros((1, 3, 1, 3)),
        face_residual=np.zeros((1, 3, len(x))),
        names=("A",),
        positions=np.zeros((1, 3)),
        surface=surface,
    )


def redness(image):
    """Mean of red minus blue over the picture, −255 … 255."""
    return float(image[..., 0].astype(float).mean() - image[..., 2].astype(float).mean())


def picture(ax):
    return np.asarray(ax.get_images()[0].get_array())


def test_every_mode_has_a_panel_with_its_frequency(housing):
    drawn = mode_shapes(housing, modes=[2, 0], engine="matplotlib")
    assert [ax.get_title(loc="left") for ax in drawn] == ["3: 990 Hz, ζ 2 %", "1: 500 Hz, ζ 2 %"]


def test_side_that_moves_outward_is_red_and_the_other_blue(housing):
    from_right = mode_shapes(housing, modes=[0], elevation=0.0, azimuth=np.pi / 2, engine="matplotlib")
    from_left = mode_shapes(housing, modes=[0], elevation=0.0, azimuth=-np.pi / 2, engine="matplotlib")
    assert redness(picture(from_right[0])) > 15
    assert redness(picture(from_left[0])) < -15


def test_both_engines_draw_the_same_body(housing):
    """Where there is no off-screen rendering both are matplotlib's."""
    one = picture(mode_shapes(housing, modes=[0], engine="matplotlib")[0])
    other = picture(mode_shapes(housing, modes=[0])[0])
    ratio = [image.shape[0] / image.shape[1] for image in (one, other)]
    assert ratio[0] == pytest.approx(ratio[1], rel=0.05)
    assert redness(one) == pytest.approx(redness(other), abs=8)


def test_picture_does_not_touch_its_border_without_cropping(housing):
    surface = housing.surface
    box = (surface.vertices.min(axis=0), surface.vertices.max(axis=0))
    corners, black = surface.vertices[surface.triangles], np.zeros((3 * len(surface.areas), 3))
    white = shapes._drawn(corners, black, box, View(0.45, 0.6))
    border = np.concatenate([white[0], white[-1], white[:, 0], white[:, -1]])
    assert (border == 255).all()


def test_operating_shape_is_drawn_at_the_instant_of_most_motion(housing_velocity):
    turned = housing_velocity.replace(normal_velocity=housing_velocity.normal_velocity * np.exp(1.3j))
    ax = operating_shape(turned, line=1, name="solid", engine="matplotlib")
    assert ax.get_title(loc="left") == "solid: 300 Hz"
    bar = ax.figure.axes[-1]
    top = 1e3 * np.abs(housing_velocity.normal_velocity[1]).max()
    assert bar.get_ylim()[1] == pytest.approx(top, rel=1e-6)


def test_animation_runs_through_one_period(housing, tmp_path):
    path = animate(housing.surface, housing.normal_shapes[0], tmp_path / "m.gif", frames=4, engine="matplotlib")
    with Image.open(path) as film:
        assert film.n_frames == 4
        assert film.info["loop"] == 0
        frames = []
        for number in range(4):
            film.seek(number)
            frames.append(np.asarray(film.convert("RGB")).astype(float))
    assert len({frame.shape for frame in frames}) == 1
    # half a period apart the motion is opposite, a quarter apart it is nil at t = T/4 and 3T/4
    assert np.abs(frames[0] - frames[2]).mean() > 4 * np.abs(frames[1] - frames[3]).mean()


def test_renderer_that_crashes_leaves_the_picture_to_matplotlib(housing, monkeypatch):
    monkeypatch.setattr(_pyvista.sys, "executable", "/bin/false")
    surface = housing.surface
    colours = np.zeros((1, 3 * len(surface.areas), 3))
    towards = np.array([0.0, 0.0, 1.0])
    assert _pyvista.render_frames(surface.vertices[None], surface.triangles, colours, towards) is None
    assert picture(mode_shapes(housing, modes=[1])[0]).size > 0
    with pytest.raises(InputError, match="cannot render off screen"):
        mode_shapes(housing, modes=[1], engine="pyvista")


@pytest.mark.parametrize(
    ("options", "message"),
    [({"frames": 2}, "frames = 2"), ({"seconds": 0.0}, "seconds = 0"), ({"engine": "paint"}, "engine = 'paint'")],
)
def test_animation_that_cannot_be_made_is_refused(housing, tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        animate(housing.surface, housing.normal_shapes[0], tmp_path / "m.gif", **options)


def test_unknown_mode_is_refused(housing):
    with pytest.raises(InputError, match="numbers from 0 to 2"):
        mode_shapes(housing, modes=[3])


def test_table_of_assurance_writes_out_what_is_not_nil():
    table = np.array([[1.0, 0.3], [0.01, 0.9]])
    ax = modal_assurance_table(table, np.array([100.0, 200.0]), np.array([101.0, 199.0]), row_name="ours")
    assert [text.get_text() for text in ax.texts] == ["1.00", "0.30", "0.90"]
    assert ax.get_ylabel() == "ours: natural frequency / Hz"


def test_bars_show_shares_that_sum_to_one_with_the_rest_in_one():
    pressure = np.array([0.5, -0.2, 0.05, 0.65]) * np.exp(0.4j)
    ax = contribution_bars(["a", "b", "c", "d"], pressure, frequency=440.0, count=2, title="modes")
    assert [label.get_text() for label in ax.get_yticklabels()] == ["d", "a", "2 others"]
    assert [bar.get_width() for bar in ax.patches] == pytest.approx([65.0, 50.0, -15.0])
    assert ax.get_title(loc="left") == "modes: 440 Hz, 91.0 dB"
    with pytest.raises(InputError, match="add up to silence"):
        contribution_bars(["a", "b"], np.array([1.0, -1.0]), frequency=1.0)


def test_housing_without_modes_has_no_shapes_to_draw(housing):
    bare = {name: getattr(housing, name)[:0] for name in ("natural_frequency", "modal_damping", "seat_shapes")}
    with pytest.raises(InputError, match="has no modes, only Ritz vectors"):
        mode_shapes(housing.replace(**bare, normal_shapes=housing.normal_shapes[:0]), engine="matplotlib")
