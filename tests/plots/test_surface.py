"""The picture of the surface colours every face by its level and always finds a renderer."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from nvhchain.errors import InputError
from nvhchain.handoff import Surface
from nvhchain.plots import rendered_surface, strongest_line, surface_velocity
from nvhchain.plots.bodies import _pyvista
from nvhchain.plots.bodies.surface import corner_means


def test_strongest_line_is_chosen_and_named_with_its_velocity(housing_velocity):
    assert strongest_line(housing_velocity) == 1
    ax = surface_velocity(housing_velocity, name="slotted", engine="matplotlib")
    areas = housing_velocity.surface.areas
    mean = np.sqrt(0.5 * (np.abs(housing_velocity.normal_velocity[1]) ** 2 @ areas) / areas.sum())
    assert ax.get_title(loc="left") == f"slotted: 300 Hz, {1e3 * mean:.3g} mm/s RMS over the surface"


def test_matplotlib_draws_exactly_the_faces_that_look_at_the_viewer(housing_velocity):
    ax = surface_velocity(housing_velocity, engine="matplotlib", elevation=0.45, azimuth=0.6)
    (faces,) = [c for c in ax.collections if isinstance(c, Poly3DCollection)]
    # Three of the six sides of the box, 14 x 14 squares of two triangles each.
    assert len(faces.get_facecolors()) == 3 * 14 * 14 * 2


def test_colour_bar_ends_at_the_highest_level_and_names_its_reference(housing_velocity):
    ax = surface_velocity(housing_velocity, engine="matplotlib", dynamic_range=30.0)
    bar = ax.figure.axes[1]
    assert bar.get_ylabel() == "normal velocity level / dB re 1 nm/s"
    highest = 20.0 * np.log10(np.abs(housing_velocity.normal_velocity[1]).max() / np.sqrt(2.0) / 1e-9)
    low, high = bar.get_ylim()
    assert highest <= high < highest + 1.0
    assert high - low == pytest.approx(30.0)


def test_machine_without_off_screen_rendering_falls_back_to_matplotlib(housing_velocity, monkeypatch):
    monkeypatch.setattr(_pyvista, "render", lambda *_: None)
    ax = surface_velocity(housing_velocity)
    assert any(isinstance(c, Poly3DCollection) for c in ax.collections)
    with pytest.raises(InputError, match="cannot render off screen"):
        surface_velocity(housing_velocity, engine="pyvista")


def test_a_picture_that_was_rendered_before_is_shown_and_not_rendered_again(housing_velocity, monkeypatch):
    asked = []
    monkeypatch.setattr(_pyvista, "render", lambda *scene: asked.append(scene) or np.full((4, 6, 3), 7, np.uint8))
    image = rendered_surface(housing_velocity, dynamic_range=30.0)
    ax = surface_velocity(housing_velocity, dynamic_range=30.0, image=image)
    assert np.array_equal(ax.images[0].get_array(), image)
    assert len(asked) == 1
    surface_velocity(housing_velocity, dynamic_range=30.0)
    (surface, colours, towards), again = asked
    assert again[0] is surface
    assert np.array_equal(again[1], colours)
    assert np.array_equal(again[2], towards)


def test_renderer_that_crashes_gives_no_picture(housing_velocity, monkeypatch):
    monkeypatch.setattr(_pyvista.sys, "executable", "/bin/false")
    assert (
        _pyvista.render(
            housing_velocity.surface, np.zeros((len(housing_velocity.surface.areas), 3, 3)), np.array([0.0, 0.0, 1.0])
        )
        is None
    )


def test_unknown_engine_is_refused(housing_velocity):
    with pytest.raises(InputError, match="engine = 'paraview'"):
        surface_velocity(housing_velocity, engine="paraview")


def test_colours_pass_over_alike_faces_and_stop_at_creases():
    """Box of two triangles a side: both of a side share their values, the other sides none."""
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    box = Surface(corners, np.array([triangle for a, b, c, d in quads for triangle in ([a, b, c], [a, c, d])]))
    side = np.repeat(np.arange(6.0), 2)
    assert np.allclose(corner_means(box) @ side, np.repeat(side, 3))
    found = (corner_means(box) @ np.tile([0.0, 1.0], 6)).reshape(-1, 3)
    assert np.allclose(found[0], [0.5, 0.0, 0.5])  # the corner that the second triangle does not have keeps its value


def test_picture_has_a_margin_around_the_body():
    image = np.full((40, 60, 3), 255, dtype=np.uint8)
    image[10:30, 5:55] = 0
    inside = (trimmed := _pyvista.trimmed(image)).min(axis=2) == 0
    assert inside.sum() == 20 * 50
    assert not inside[0].any()
    assert not inside[:, 0].any()
    assert trimmed.shape[:2] == (24, 54)
