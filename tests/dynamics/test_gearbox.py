"""Case data: inertias of known bodies, and refusals that name field, value, limit and remedy."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import Bearing, Cylinder, Mesh, RigidBody, Shaft, static_bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.errors import InputError


def test_a_solid_cylinder_has_its_textbook_inertia():
    body = Cylinder(0.1, 0.3, 0.05, density=7850.0).rigid_body()
    mass = 7850.0 * pi * 0.025**2 * 0.2
    assert (body.z, body.mass) == (pytest.approx(0.2), pytest.approx(mass))
    assert body.polar_inertia == pytest.approx(mass * 0.025**2 / 2)
    assert body.transverse_inertia == pytest.approx(mass * (3 * 0.025**2 + 0.2**2) / 12)


def test_pieces_of_a_shaft_add_up_to_the_whole():
    whole = Shaft("S", (0, 0), (Cylinder(-0.1, 0.3, 0.05, 0.02),)).inertia()
    pieces = Shaft("S", (0, 0), (Cylinder(-0.1, 0.05, 0.05, 0.02), Cylinder(0.05, 0.3, 0.05, 0.02))).inertia()
    for field in ("z", "mass", "polar_inertia", "transverse_inertia"):
        assert getattr(pieces, field) == pytest.approx(getattr(whole, field), rel=1e-12)


def test_bodies_added_later_count(make_gearbox):
    gearbox = make_gearbox()
    heavier = gearbox.add_bodies("B", [RigidBody(0.0, 1.0, 1e-3, 1e-3)])
    assert heavier.shafts[1].inertia().mass == pytest.approx(gearbox.shafts[1].inertia().mass + 1.0)
    with pytest.raises(InputError, match="shaft 'X' is unknown; known: A, B, C"):
        gearbox.add_bodies("X", [])


def test_bad_case_data_is_refused_with_field_value_and_remedy(make_gearbox):
    gearbox = make_gearbox()
    with pytest.raises(InputError, match=r"segment: outer_diameter = -0\.03 m is outside"):
        Cylinder(0, 1, -0.03)
    with pytest.raises(InputError, match="bearing A1: radial_stiffness = 163 N/m is outside 1000"):
        Bearing("A1", "A", 0.0, radial_stiffness=163)
    with pytest.raises(InputError, match="shaft S: coupling_z = nan m is outside"):
        Shaft("S", (0, 0), coupling_z=float("nan"))
    single = Bearing("A1", "A", 0.0, radial_stiffness=np.float32(1.6e8))
    assert type(single.radial_stiffness) is float
    assert single == Bearing("A1", "A", 0.0, radial_stiffness=1.6e8)
    with pytest.raises(InputError, match="more than twice transverse_inertia"):
        RigidBody(0.0, 1.0, 3e-3, 1e-3)
    with pytest.raises(InputError, match="shaft 'D' is unknown; known shafts: A, B, C"):
        replace(gearbox, bearings=(*gearbox.bearings, Bearing("D1", "D", 0.0)))
    with pytest.raises(InputError, match="shaft C has bearings in 1 plane"):
        replace(gearbox, bearings=gearbox.bearings[:-1])
    with pytest.raises(InputError, match="no mesh joins shaft"):
        replace(gearbox, meshes=gearbox.meshes[:1])
    with pytest.raises(InputError, match="power-split"):
        replace(gearbox, meshes=(*gearbox.meshes, Mesh("A", "C", 0.0)))
    with pytest.raises(InputError, match="both 'A'"):
        replace(gearbox, output_shaft="A")
    with pytest.raises(InputError, match=r"must be \+1 or −1"):
        replace(gearbox, input_rotation=0)
    with pytest.raises(InputError, match="has no mass"):
        Shaft("S", (0, 0)).inertia()


def test_parts_that_do_not_fit_together_are_refused(make_gearbox, make_laws, make_housing):
    gearbox, laws = make_gearbox(), make_laws()
    housing = make_housing(gearbox, modes=3)
    with pytest.raises(InputError, match="1 mesh laws for 2 meshes"):
        assemble(gearbox, laws[:1], None)
    with pytest.raises(InputError, match=r"the shaft axes are 95\.9578 mm apart, but its mesh law is for"):
        assemble(gearbox, (laws[0].replace(centre_distance=0.0961), laws[1]), None)
    with pytest.raises(InputError, match="do not stand in the ratio of the teeth"):
        assemble(gearbox, (laws[0].replace(base_radius=laws[0].base_radius * [1.01, 1]), laws[1]), None)
    with pytest.raises(InputError, match="bearing A1 has no seat in the housing; its seats: Z1, A2"):
        assemble(gearbox, laws, housing.replace(names=("Z1", *housing.names[1:])))
    with pytest.raises(InputError, match="bearing B2 lies 5 mm from its seat"):
        assemble(
            gearbox, laws, housing.replace(positions=housing.positions + np.outer(np.arange(6) == 3, [0, 0, 5e-3]))
        )
    with pytest.raises(InputError, match="rigid-body mode"):
        assemble(gearbox, laws, housing.replace(natural_frequency=[0.0, 100.0, 200.0]))


def test_seats_are_matched_by_name_not_by_order(make_gearbox, make_laws, make_housing):
    gearbox, laws = make_gearbox(), make_laws()
    housing = make_housing(gearbox, modes=5)
    order = [4, 0, 5, 3, 1, 2]
    shuffled = housing.replace(
        names=tuple(housing.names[i] for i in order),
        positions=housing.positions[order],
        seat_shapes=housing.seat_shapes[:, order],
        seat_residual=housing.seat_residual[order][:, :, order],
        face_residual=housing.face_residual[order],
    )
    one, other = (static_bearing_forces(gearbox, laws, h, input_torque=250.0) for h in (housing, shuffled))
    assert other == pytest.approx(one, rel=1e-9)


def test_housing_without_modes_is_a_rigid_wall_with_soft_seats(make_gearbox, make_laws, make_housing):
    gearbox, laws = make_gearbox(), make_laws()
    wall = make_housing(gearbox, modes=0, residual=1e-6)
    soft, rigid = (static_bearing_forces(gearbox, laws, h, input_torque=250.0) for h in (wall, None))
    assert soft == pytest.approx(rigid, abs=1e-4 * np.abs(rigid).max())


def test_coupled_inertia_resists_torsion_only(make_gearbox, make_laws):
    gearbox, laws = make_gearbox(), make_laws()
    shaft = gearbox.shafts[0]
    coupled = replace(gearbox, shafts=(replace(shaft, coupled_inertia=0.02), *gearbox.shafts[1:]))
    plain, heavy = assemble(gearbox, laws, None), assemble(coupled, laws, None)
    assert heavy.inertia[0] - plain.inertia[0] == pytest.approx(0.02, rel=1e-12)
    assert np.array_equal(heavy.mass, plain.mass)
    with pytest.raises(InputError, match="coupled_inertia"):
        replace(shaft, coupled_inertia=-1.0)
