"""Transmission error curves and the map of a mesh law show the numbers they are given."""

import numpy as np

from nvhchain.plots import mesh_law_map, transmission_errors

MESH = 2.0 * np.pi / 50.0
SECTOR = 2.0 * np.pi / 5.0


def test_short_period_is_repeated_over_the_longest_and_closed():
    short, long = np.linspace(0, MESH, 24, endpoint=False), np.linspace(0, SECTOR, 240, endpoint=False)
    error = 20e-6 + 1e-6 * np.cos(50 * short)
    (ax,) = transmission_errors(
        {"stage 1": {"solid": (short, error), "slotted": (long, 2e-5 + 3e-6 * np.cos(5 * long))}}
    )
    solid, slotted = ax.lines
    np.testing.assert_allclose(solid.get_ydata(), 20.0 + np.cos(50.0 * np.radians(solid.get_xdata())), atol=1e-9)
    np.testing.assert_allclose([solid.get_xdata()[-1], slotted.get_xdata()[-1]], 72.0)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == ["solid: 2 µm peak to peak", "slotted: 6 µm peak to peak"]
    assert ax.get_ylabel() == "transmission error / µm"
    ax.figure.canvas.draw()
    assert ax.get_legend().get_window_extent().x0 >= ax.get_window_extent().x1  # hides no curve


def test_every_stage_has_its_own_panel_and_scales():
    angle = np.linspace(0, MESH, 24, endpoint=False)
    axes = transmission_errors({"stage 1": {"solid": (angle, 1e-6 * angle)}, "stage 2": {"solid": (9 * angle, angle)}})
    assert [ax.get_title(loc="left") for ax in axes] == ["stage 1", "stage 2"]
    assert axes[0].get_xlim() != axes[1].get_xlim()


def test_map_shows_force_in_kilonewton_over_one_closed_body_period(mesh_law):
    (ax,) = mesh_law_map(mesh_law)
    mesh = ax.collections[0]
    np.testing.assert_allclose(np.asarray(mesh.get_array())[:, 0], 1e-3 * mesh_law.force[0], atol=1e-12)
    np.testing.assert_allclose(np.asarray(mesh.get_array())[:, -1], 1e-3 * mesh_law.force[0], atol=1e-12)
    assert mesh.get_clim() == (-mesh.get_clim()[1], mesh.get_clim()[1])
    np.testing.assert_allclose(ax.get_xlim(), [0.0, 72.0])
    assert ax.figure.axes[1].get_ylabel() == "force along the flank normal / kN"
