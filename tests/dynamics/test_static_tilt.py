"""Gears that tilt under load: the balance with their teeth, and meshes about that tilt, against a direct solution."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import nvhchain as nvh
from nvhchain import dynamics, gear
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.law_table import tabulate
from nvhchain.dynamics.time_loop.quasi_static import laws_of_rows, nominal_mesh_forces, static_state
from nvhchain.gear.contact.engagement import Engagement
from nvhchain.gear.laws.mesh_law import pair_compliances
from nvhchain.gear.laws.transmission_error import loaded_mesh
from nvhchain.scene.linear_level import TEETH
from nvhchain.scene.loaded_tilt import balanced_tilts, tilted
from nvhchain.testing.coarse_runs import SMALL

KNOBS = replace(TEETH, slices=12, angles_per_mesh=8, deflections_per_doubling=4)


class Leaning:
    """The small gearbox with faces of 28 mm, one of whose bearings is eight times softer: 0.6 mrad without teeth."""

    def __init__(self):
        wider = [f"gears.{name}.geometry.face_width_mm=28" for name in ("pinion", "wheel")]
        case = nvh.load_case(SMALL, changes=wider)
        self.torque, self.force, self.pair = case.operation.input_torque, case.mesh_forces[0], case.pairs[0]
        box, self.straight = case.gearbox_with_gears, case.straight_laws
        first, *others = box.bearings
        self.box = replace(box, bearings=(replace(first, radial_stiffness=first.radial_stiffness / 8), *others))
        self.compliances = pair_compliances(self.pair, KNOBS)
        self.angles = np.arange(8) / 8 * self.pair.mesh_period
        self.free = self.tilts(np.zeros(1))[0]
        self.give = float((self.free - self.tilts(np.ones(1))[0])[0])

    def tilts(self, moment):
        return dynamics.opposed_misalignment(self.box, self.straight, None, input_torque=self.torque)(moment)

    def balanced(self):
        def loaded(_, pair):
            return gear.mesh_period(pair, nominal_force=self.force, fidelity=KNOBS, compliances=self.compliances)

        return balanced_tilts([self.pair], [self.force], self.tilts, loaded)[0]

    def direct(self):
        """Tilt and deflection at every angle where the shafts balance the load of that angle, by bisection."""
        lean = np.cos(self.pair.base_helix_angle)

        def contact(moment, angle):
            tilt = self.free - [self.give * moment, 0.0]
            of = loaded_mesh(
                Engagement(tilted(self.pair, tilt), self.compliances, KNOBS), angle, self.force, guess=1e-9 * self.force
            )
            return tilt[0], of.deflection, lean * float(of.force @ of.lines.axial)

        most, found = 0.5 * self.force * self.pair.face_width, []
        for angle in map(float, self.angles):
            moment = brentq(lambda m, at=angle: contact(m, at)[2] - m, -most, most, xtol=1e-2)
            found.append(contact(moment, angle)[:2])
        return np.array(found).T

    def modelled(self, tilt, *, points, about, shuttling=False):
        """Tilt and deflection at every angle by the laws of the dynamics."""
        pair, lean = tilted(self.pair, tilt), np.cos(self.pair.base_helix_angle)
        given = {"nominal_force": self.force, "fidelity": KNOBS, "compliances": self.compliances}
        spread = gear.load_distribution(pair, **given)
        law = gear.mesh_law(pair, **given).replace(tilt_ratio=spread.tilt_ratio)
        (mesh,) = self.box.meshes
        if shuttling:
            mesh = replace(mesh, load_centre=dynamics.LoadCentre(spread.period, spread.angle, spread.offset))
        if about:
            moment = 0.0 if shuttling else self.force * lean * float(spread.offset.mean())
            mesh = replace(mesh, static_tilt=dynamics.StaticTilt(*map(float, tilt), moment))
        of = assemble(replace(self.box, face_points=points, meshes=(mesh,)), [law], None)
        torque = shaft_torques(of.gearbox, of.train, self.torque)
        table = tabulate(laws_of_rows(of, [law], nominal_mesh_forces(of, [law], torque)), 1)
        places = [static_state(of, table, torque, np.array([angle / law.period])).position for angle in self.angles]
        drive = of.contact[0 : 2 * points : 2]
        return np.array([((of.misalignment @ x)[0], (drive @ x).mean()) for x in places]).T


@pytest.fixture(scope="module")
def leaning():
    return Leaning()


@pytest.fixture(scope="module")
def direct(leaning):
    return leaning.direct()


def swing(deflection):
    return np.abs(np.fft.rfft(deflection)[1])


def test_teeth_and_shafts_balance_the_tilt_under_load(leaning, direct):
    """Without their resistance the tilt would be a quarter larger."""
    tilt, normal = leaning.balanced()
    assert tilt == pytest.approx(direct[0].mean(), rel=2e-3)
    assert leaning.free[0] > 1.2 * tilt
    assert normal == pytest.approx(leaning.free[1], rel=1e-9)


@pytest.mark.parametrize("shuttling", [False, True])
def test_meshes_about_the_static_tilt_deflect_as_the_tilted_contact_does(leaning, direct, shuttling):
    """First harmonic of the deflection: 5 dB too small without the law of tilted flanks, 2 dB too large unresisted."""
    tilt = leaning.balanced()
    found = leaning.modelled(tilt, points=2, about=True, shuttling=shuttling)
    assert found[0].mean() == pytest.approx(direct[0].mean(), rel=3e-3)
    assert swing(found[1]) == pytest.approx(swing(direct[1]), rel=0.05)
    assert swing(leaning.modelled(np.zeros(2), points=2, about=False)[1]) < 0.7 * swing(direct[1])
    assert swing(leaning.modelled(leaning.free, points=1, about=False)[1]) > 1.1 * swing(direct[1])
    if shuttling:  # the tilt then follows the centre of the load
        assert np.ptp(found[0]) == pytest.approx(np.ptp(direct[0]), rel=0.1)


def test_flanks_without_load_or_under_negative_force_do_not_oppose_the_tilt(leaning):
    for force in (0.0, -leaning.force):
        found = balanced_tilts([leaning.pair], [force], leaning.tilts, None)
        np.testing.assert_array_equal(found[0], leaning.free)


def test_back_flanks_shift_by_the_tilt_in_their_own_plane(leaning):
    """Both flanks of every point, at the static tilt, are pressed as those at mid-width are."""
    (mesh,), psi = leaning.box.meshes, (3e-4, -2e-4)
    law = gear.mesh_law(leaning.pair, nominal_force=leaning.force, fidelity=KNOBS, compliances=leaning.compliances)
    box = replace(leaning.box, face_points=2, meshes=(replace(mesh, static_tilt=dynamics.StaticTilt(*psi)),))
    of = assemble(box, [law], None)
    laws = laws_of_rows(of, [law], np.array([leaning.force]))
    leans = np.linalg.lstsq(of.misalignment, np.array(psi), rcond=None)[0]  # tilts alone
    pressed = of.contact @ leans
    middle = pressed.reshape(2, 2).mean(axis=0)
    for point, own in enumerate(laws):
        drive, back = pressed[2 * point : 2 * point + 2] - middle
        moved = own.deflection - law.deflection
        np.testing.assert_allclose(moved[law.deflection >= 0.0], drive, rtol=1e-6)
        np.testing.assert_allclose(moved[law.deflection < 0.0], -back, rtol=1e-6)
