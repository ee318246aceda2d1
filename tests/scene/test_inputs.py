"""Effects of inputs that are rarely known, and the limits that include them."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.case import PLAIN, Spread
from nvhchain.error_band import COVERAGE, ErrorBand
from nvhchain.errors import InputError
from nvhchain.scene.inputs import input_effects, unknown_effects
from nvhchain.scene.linear_level import LinearGearbox, level_change

BENT = replace(PLAIN, flexible_shafts=True, friction=0.05)


@pytest.fixture(scope="module")
def small(request):
    case = nvh.load_case(request.config.rootpath / "cases" / "small" / "single_stage.toml")
    return replace(case, options=BENT)


def test_effects_are_those_of_cases_with_other_values(small):
    spread = Spread(bearing_stiffness=1.5, damping=3.0, friction=2.0)
    found = {each.name: each for each in input_effects(replace(small, spread=spread))}
    nominal = LinearGearbox(small).power(BENT)

    def changed(**values):
        bearings = tuple(
            replace(b, **{name: factor * getattr(b, name) for name, factor in values.items()}) for b in small.bearings
        )
        return level_change(nominal, LinearGearbox(replace(small, bearings=bearings)).power(BENT))

    stiff, soft = ({"radial_stiffness": f, "axial_stiffness": f} for f in (1.5, 1 / 1.5))
    assert found["bearing stiffness"].high_db == pytest.approx(changed(**stiff), abs=1e-3)
    assert found["bearing stiffness"].low_db == pytest.approx(changed(**soft), abs=1e-3)
    rough = LinearGearbox(small).power(replace(BENT, friction=0.1))
    assert found["friction"].high_db == pytest.approx(level_change(nominal, rough), abs=1e-3)
    assert found["damping"].low_db > 0.0 > found["damping"].high_db
    assert [each.largest_db for each in found.values()] == sorted((e.largest_db for e in found.values()), reverse=True)


def test_a_known_input_has_no_effect_and_an_absurd_spread_is_refused(small):
    assert {each.name for each in input_effects(replace(small, spread=Spread(bearing_stiffness=1.0)))} == {
        "damping",
        "friction",
    }
    assert "friction" not in {each.name for each in input_effects(replace(small, options=PLAIN))}
    with pytest.raises(InputError, match=r"spread damping = 0\.5 is outside 1…10"):
        Spread(damping=0.5)


def test_damping_that_a_case_lacks_is_in_the_limits_over_its_stated_range(small):
    """0.25 to 2.5e-5 s about the 1.25e-5 s that bearings without damping take; nothing else without a spread."""
    bare = replace(small, bearings=tuple(replace(b, radial_damping=0.0, axial_damping=0.0) for b in small.bearings))
    assert unknown_effects(small) == ()
    (only,) = unknown_effects(bare)
    assert (only.name, only.divisor, only.factor) == ("damping", 5.0, 2.0)
    assert only.line.startswith("damping ÷ 5 and × 2: +")
    assert len(unknown_effects(replace(bare, spread=Spread()))) == 3


def test_a_source_more_widens_the_limits_by_its_share():
    band = ErrorBand(np.array([1000.0, 2000.0]), np.array([[1.0], [0.5]]), {})
    wider = band.widened("input: damping", np.array([0.2, 0.0]) / COVERAGE)
    np.testing.assert_allclose(10 ** ((wider.upper - band.upper) / 20), [[1.2], [1.0]])
    np.testing.assert_allclose(10 ** ((wider.lower - band.lower) / 20), [[0.8], [1.0]])
    assert wider.parts[0][0] == "input: damping"
