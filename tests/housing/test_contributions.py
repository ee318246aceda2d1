"""Contributions of modes and panels to the pressure, modal assurance, names of the panels."""

from functools import partial

import numpy as np
import pytest

from nvhchain.acoustics import modal_pressure, modal_transfer_vectors, radiate
from nvhchain.conventions import Air
from nvhchain.errors import InputError
from nvhchain.handoff import ForceSpectrum, TransferVectors
from nvhchain.housing import respond
from nvhchain.housing.casting.contributions import (
    casting_panels,
    group_panels,
    modal_contributions,
    panel_contributions,
)
from nvhchain.housing.modes.modal_assurance import modal_assurance, paired_modes

LINES = np.array([400.0, 1800.0, 3000.0])


@pytest.fixture(scope="module")
def vectors(surface):
    """Monopoles in the free field: enough for sums over modes and panels."""
    points = np.array([[1.0, 0.2, 0.3], [-0.5, 1.0, 0.0]])
    distance = np.linalg.norm(points[:, None] - surface.centroids, axis=2)
    k = 2 * np.pi * LINES[:, None, None] / Air().speed_of_sound
    green = 1j * k * Air().impedance * np.exp(-1j * k * distance) / (4 * np.pi * distance)
    return TransferVectors(LINES, points, green * surface.areas, surface, Air())


@pytest.fixture(scope="module")
def load(reduced):
    rng = np.random.default_rng(6)
    force = rng.standard_normal((3, 2, 3)) + 1j * rng.standard_normal((3, 2, 3))
    return ForceSpectrum(LINES, force, reduced.names)


def test_modes_and_residual_add_up_to_the_pressure(vectors, reduced, load):
    modal = modal_transfer_vectors(vectors, reduced, LINES)
    parts = modal_contributions(modal, reduced, load)
    exact = modal_pressure(modal, reduced, load).pressure
    assert parts.pressure.shape == (3, 2, reduced.mode_count + 1)
    assert parts.total == pytest.approx(exact, rel=1e-12)
    assert parts.shares.sum(axis=2) == pytest.approx(np.ones((3, 2)))


def test_mode_at_its_resonance_leads(vectors, reduced, load):
    modal = modal_transfer_vectors(vectors, reduced, LINES)
    parts = modal_contributions(modal, reduced, load)
    nearest = int(np.abs(reduced.natural_frequency - 1800.0).argmin())
    assert np.abs(parts.pressure[1, :, :-1]).argmax(axis=1).tolist() == [nearest, nearest]
    assert parts.names[nearest] == f"mode {nearest + 1}, {reduced.natural_frequency[nearest]:.0f} Hz"


def test_panels_add_up_to_the_pressure(vectors, reduced, casting, load):
    velocity = respond(reduced, load)
    panels = casting_panels(casting, reduced.surface)
    parts = panel_contributions(velocity, panels, partial(radiate, vectors))
    assert parts.total == pytest.approx(radiate(vectors, velocity).pressure, rel=1e-12)
    assert not parts.pressure[:, :, panels.names.index("mounting side")].any()


def test_panels_of_the_casting_are_where_their_names_say(casting, surface):
    panels = casting_panels(casting, surface)
    assert panels.names[-1] == "boss A2"
    part = {name: panels.part == i for i, name in enumerate(panels.names)}
    assert all(faces.any() for faces in part.values())
    z = surface.centroids[:, 2]
    assert z[part["boss A2"]].min() > 0.14
    assert z[part["flange"]].max() < 0.03
    assert z[part["mounting side"]] == pytest.approx(0.0, abs=1e-9)
    assert (surface.normals[part["side wall −x"], 0] < 0).all()
    radius = casting.bores[1].radius + casting.boss_thickness
    top = part["boss A2"] & (surface.normals[:, 2] > 0.9)
    assert surface.areas[top].sum() == pytest.approx(np.pi * radius**2, rel=0.25)


def test_groups_of_points_make_panels(surface):
    low, high = surface.centroids[:, 2].min(), surface.centroids[:, 2].max()
    panels = group_panels(surface, {"low": np.array([[0, 0, low]]), "high": np.array([[0, 0, high]])})
    assert set(panels.part[surface.centroids[:, 2] < low + 1e-3]) == {0}
    assert set(panels.part[surface.centroids[:, 2] > high - 1e-3]) == {1}


def test_assurance_of_a_housing_with_itself_is_one_on_the_diagonal(reduced):
    table = modal_assurance(reduced, reduced)
    assert np.diag(table) == pytest.approx(np.ones(len(table)))
    assert (table <= 1 + 1e-12).all()
    area = np.sqrt(reduced.surface.areas)
    other = reduced.normal_shapes * area
    exact = np.dot(other[0], other[1]) ** 2 / (other[0] @ other[0] * (other[1] @ other[1]))
    assert table[0, 1] == pytest.approx(exact)


def test_modes_of_a_like_housing_are_paired_by_shape_and_not_by_number(reduced):
    """The other housing counts its bearings and two of its modes the other way about, at frequencies 2 % higher."""
    order = np.arange(len(reduced.natural_frequency))
    near = int(np.diff(np.log(reduced.natural_frequency[: reduced.mode_count])).argmin())
    order[[near, near + 1]] = near + 1, near
    other = reduced.replace(
        natural_frequency=1.02 * reduced.natural_frequency,
        seat_shapes=-reduced.seat_shapes[order][:, ::-1],
        normal_shapes=-reduced.normal_shapes[order],
        names=reduced.names[::-1],
    )
    assert paired_modes(reduced, other) == list(enumerate(order[: reduced.mode_count].tolist()))


def test_modes_of_other_shapes_frequencies_or_bearings_have_no_partner(reduced):
    count = reduced.mode_count
    far = reduced.replace(natural_frequency=1.5 * reduced.natural_frequency)
    seats, faces = reduced.seat_shapes.copy(), reduced.normal_shapes.copy()
    seats[0], faces[0] = np.roll(seats[0], 1, axis=1), faces[0, ::-1]
    bent = reduced.replace(seat_shapes=seats, normal_shapes=faces)
    elsewhere = reduced.replace(names=("other", *reduced.names[1:]))
    assert not [pair for pair in paired_modes(reduced, far) if pair[0] == pair[1]]
    assert paired_modes(reduced, bent) == [(number, number) for number in range(1, count)]
    assert paired_modes(reduced, elsewhere) == []


@pytest.mark.parametrize(("agreement", "paired"), [(0.75, False), (0.85, True)])
def test_a_mode_is_paired_where_most_of_its_shape_agrees(reduced, agreement, paired):
    weight, faces = np.sqrt(reduced.surface.areas), reduced.normal_shapes.copy()
    shapes = faces * weight
    aside = np.random.default_rng(1).normal(size=len(weight))
    aside -= shapes.T @ np.linalg.lstsq(shapes.T, aside, rcond=None)[0]  # no other mode has any of it
    aside *= np.sqrt(1 / agreement - 1) * np.linalg.norm(shapes[0]) / np.linalg.norm(aside)
    faces[0] += aside / weight
    assert ((0, 0) in paired_modes(reduced, reduced.replace(normal_shapes=faces))) is paired


def test_load_at_other_lines_is_refused(vectors, reduced, load):
    modal = modal_transfer_vectors(vectors, reduced, LINES[:2])
    with pytest.raises(InputError, match="the load has 3 lines"):
        modal_contributions(modal, reduced, load)
    with pytest.raises(InputError, match="belong to another housing"):
        modal_contributions(modal, reduced.replace(modal_damping=2 * reduced.modal_damping), load)
