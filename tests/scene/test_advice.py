"""What `plan` and `check` say about options of the dynamics that a gearbox would notice."""

import re
from dataclasses import replace
from math import pi

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import Options, Ramp
from nvhchain.cli import main
from nvhchain.dynamics import Bearing, Cylinder, Shaft
from nvhchain.gear import SOLID, GearBody, GearGeometry, GearPair
from nvhchain.scene.advice import MEASURED, advice, bending_share, load_swing


@pytest.fixture(scope="module")
def case(request):
    return nvh.load_case(request.config.rootpath / "cases" / "gearbox" / "solid.toml")


def named(case):
    return {name for why in advice(case) for name in MEASURED if f"options.{name} " in why}


def test_the_example_would_notice_all_but_gyroscopic_terms(case, capsys, request):
    assert named(case) == {"friction", "shuttling", "flexible_shafts"}
    text = str(nvh.plan(case, fidelity=nvh.DRAFT))
    assert "would be noticed:" in text
    assert main(["check", str(request.config.rootpath / "cases" / "gearbox" / "solid.toml")]) == 0
    printed = capsys.readouterr().out
    for why in advice(case):
        assert why in text
        assert why in printed


def test_what_is_on_is_not_advised(case):
    on = replace(case, options=Options(friction=0.05, shuttling=True, flexible_shafts=True))
    assert advice(on) == ()
    assert "noticed" not in str(nvh.plan(on, fidelity=nvh.DRAFT))


def test_effects_are_those_measured(request):
    table = (request.config.rootpath / "docs" / "measured" / "dynamics" / "options.md").read_text()
    rows = {"friction": "friction, 0.05", "gyroscopic": "gyroscopic terms"}
    for name, effect in MEASURED.items():
        row = re.search(rf"^\| {rows.get(name, name.replace('_', ' '))} \| ([+-][\d.]+) ", table, re.MULTILINE)
        assert effect == pytest.approx(float(row[1]), abs=0.06)


@pytest.mark.parametrize("running_up", [False, True])
def test_speed_makes_gyroscopic_terms_noticed(case, running_up):
    fast = 90000 * pi / 30
    operation = case.operation
    operation = replace(operation, ramp=Ramp(fast, 10.0)) if running_up else replace(operation, input_speed=fast)
    found = [why for why in advice(replace(case, operation=operation)) if "gyroscopic" in why]
    assert found
    for why in found:
        name, rpm, percent = re.search(r"shaft (\w) at (\d+) rpm: .* parts by (\d+) %", why).groups()
        shaft = next(s for s in case.gearbox_with_gears.shafts if s.name == name)
        body, speed = shaft.inertia(), int(rpm) * pi / 30
        assert speed == pytest.approx(fast * float(case.shaft_orders[name]), rel=1e-3)
        k = sum(1.63e8 * (b.z - body.z) ** 2 for b in case.bearings if b.shaft == name)
        j, spin = body.transverse_inertia, body.polar_inertia * speed
        roots = np.sort(np.abs(np.roots([j, spin, -k])))
        assert float(percent) == pytest.approx(100 * (roots[1] - roots[0]) / roots.mean(), abs=1.0)


def test_a_spur_pair_does_not_shuttle_and_a_helical_one_by_its_overlap():
    def swing(helix):
        gears = [
            GearGeometry(z, 2.7e-3, np.radians(20), side * np.radians(helix), 22e-3, bore_radius=5e-3)
            for z, side in ((20, 1), (50, -1))
        ]
        bodies = [GearBody(of, SOLID) for of in gears]
        return load_swing(GearPair(*bodies, sum(of.pitch_radius for of in gears)))

    assert swing(0.0) < 1e-12
    assert 1e-3 < swing(10.0) < 11e-3


def test_bending_of_a_shaft_on_its_bearings_is_that_of_the_beam():
    """In the middle (l³/(48 E I) + l/(4 κ G A)) · 2 k of two bearings."""
    shaft = Shaft("S", (0.0, 0.0), (Cylinder(0.0, 0.2, 0.03),))
    bearings = [Bearing(name, "S", z) for name, z in (("1", 0.0), ("2", 0.2))]
    second, area, shear = pi * 0.015**4 / 4, pi * 0.015**2, 210e9 / 2.6
    wanted = (0.2**3 / 48 / 210e9 / second + 0.2 / 4 / (6 * 1.3 / 8.8) / shear / area) * 2 * 1.63e8
    assert bending_share(shaft, bearings, 0.1) == pytest.approx(wanted, rel=1e-6)
    assert bending_share(shaft, bearings, 0.3) == 0.0  # beyond its end it cannot be taken as flexible
