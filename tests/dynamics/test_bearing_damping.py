"""Models of bearing damping: viscous, in proportion to stiffness, structural at a frequency."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from nvhchain.dynamics import Bearing, bearing_forces
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.errors import InputError
from nvhchain.fidelity import DynamicsFidelity

BARE = {"radial_damping": 0.0, "axial_damping": 0.0}


def _with(gearbox, **damping):
    return replace(gearbox, bearings=tuple(replace(b, **(BARE | damping)) for b in gearbox.bearings))


def _axial(gearbox, laws):
    """Eigenvalues λ (3,) of the shafts' motions along z by themselves: m λ² + c λ + k = 0."""
    a = assemble(gearbox, laws, None)
    z = [2, 7, 12]
    found = []
    for i in z:
        m, c, k = a.mass[i], a.damping[i, i], a.stiffness[i, i]
        found.append((-c + np.emath.sqrt(c * c - 4 * m * k)) / (2 * m))
    return np.array(found), a.mass[z]


def test_damping_in_proportion_to_stiffness_damps_a_mode_by_half_of_beta_omega(make_gearbox, make_laws):
    gearbox, beta = make_gearbox(), 4e-6
    value, mass = _axial(_with(gearbox, stiffness_damping=beta), make_laws())
    omega = np.sqrt([2 * gearbox.bearings[0].axial_stiffness / m for m in mass])
    assert -value.real / np.abs(value) == pytest.approx(0.5 * beta * omega, rel=1e-9)


def test_structural_damping_takes_half_its_loss_factor_of_critical_where_it_is_right(make_gearbox, make_laws):
    """ζ = η ω/(2 ω_ref): η/2 for the mode at the reference frequency."""
    gearbox, laws = make_gearbox(), make_laws()
    _, mass = _axial(gearbox, laws)
    omega = np.sqrt([2 * gearbox.bearings[0].axial_stiffness / m for m in mass])
    value, _ = _axial(_with(gearbox, loss_factor=0.06, loss_factor_frequency=float(omega[1]) / 2 / pi), laws)
    ratio = -value.real / np.abs(value)
    assert ratio[1] == pytest.approx(0.03, rel=1e-9)
    assert ratio == pytest.approx(0.03 * omega / omega[1], rel=1e-9)


def test_energy_of_a_cycle_is_that_of_the_loss_factor():
    """π c ω a² of the dashpot is π η k a² of the hysteresis, at the reference frequency."""
    of = Bearing("A", "A", 0.0, loss_factor=0.1, loss_factor_frequency=500.0)
    omega = 2 * pi * 500.0
    for damping, stiffness in zip(of.damping, (of.radial_stiffness, of.axial_stiffness), strict=True):
        assert damping * omega == pytest.approx(0.1 * stiffness, rel=1e-12)


def test_all_models_add_up_to_one_dashpot(make_gearbox, make_laws, make_housing):
    """The same forces bit for bit as with the sum given as viscous damping, in series with the seat."""
    gearbox, laws = make_gearbox(), make_laws(plain_wheel=True)
    housing = make_housing(gearbox, modes=4)
    mixed = _with(gearbox, radial_damping=500.0, stiffness_damping=3e-6, loss_factor=0.05, loss_factor_frequency=1200.0)
    radial, axial = mixed.bearings[0].damping
    share = 3e-6 + 0.05 / (2 * pi * 1200.0)
    assert radial == pytest.approx(500.0 + share * 1.63e8)
    assert axial == pytest.approx(share * 5.05e7)
    plain = _with(gearbox, radial_damping=radial, axial_damping=axial)
    knobs = {"input_speed": 2500 * pi / 30, "input_torque": 250.0, "f_max": 2000.0, "fidelity": DynamicsFidelity(4e-5)}
    forces = [bearing_forces(box, laws, housing, **knobs).force for box in (mixed, plain)]
    assert np.array_equal(*forces)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"loss_factor": 0.1}, "takes both"),
        ({"loss_factor_frequency": 500.0}, "takes both"),
        ({"loss_factor": 3.0, "loss_factor_frequency": 500.0}, r"loss_factor = 3.0"),
        ({"loss_factor": 0.1, "loss_factor_frequency": 0.0}, "loss_factor_frequency = 0.0"),
        ({"loss_factor": 0.1, "loss_factor_frequency": 1.0}, r"outside 1.59\d+…100000 Hz"),
        ({"stiffness_damping": -1e-6}, "stiffness_damping = -1e-06"),
        ({"stiffness_damping": 5.0}, r"outside 0…0.01 s"),
        ({"loss_factor": float("nan"), "loss_factor_frequency": 500.0}, "nan"),
    ],
)
def test_nonsense_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        Bearing("A1", "A", 0.0, **change)


def test_a_case_states_them(request, tmp_path):
    from nvhchain import load_case

    base = request.config.rootpath / "cases" / "small" / "single_stage.toml"
    path = tmp_path / "case.toml"
    path.write_text(
        f'base = "{base}"\n[[bearings]]\nname = "A1"\nradial_damping = 0\nloss_factor = 0.04\n'
        'loss_factor_frequency = 800\n[[bearings]]\nname = "A2"\nstiffness_damping = 2e-6\n'
    )
    first, second = load_case(path).gearbox.bearings[:2]
    assert first.damping[0] == pytest.approx(0.04 * 1.63e8 / (2 * pi * 800))
    assert second.damping[0] == pytest.approx(1200 + 2e-6 * 1.63e8)
    path.write_text(path.read_text().replace("loss_factor_frequency = 800\n", ""))
    with pytest.raises(InputError, match=r"bearings\[0\].*takes both"):
        load_case(path)
