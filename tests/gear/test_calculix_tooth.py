"""One loaded tooth against CalculiX 2.20 on the very same mesh (benchmarks/gear/calculix_tooth.py made the data)."""

import dataclasses
import json
from functools import cache

import numpy as np
import pytest

from nvhchain.fidelity import DRAFT
from nvhchain.gear import (
    WHEEL,
    GearBody,
    GearGeometry,
    GearPair,
    LoadedMesh,
    RootElement,
    Slots,
    flank_compliance,
    nodal_force_strain,
    von_mises,
)
from nvhchain.gear.contact.contact_lines import contact_lines


@pytest.fixture(scope="module")
def known(request):
    """Wheel, fidelity and record of the helical wheel with slots."""

    @cache
    def load():
        path = request.config.rootpath / "tests" / "regression" / "gear" / "calculix_tooth.json"
        record = json.loads(path.read_text())["models"]["helical, 18 teeth, 3 slots"]
        blank = dict(record["blank"])
        assert blank.pop("type") == "Slots"
        wheel = GearBody(GearGeometry(**record["wheel"]), Slots(**blank))
        return wheel, dataclasses.replace(DRAFT.gear.even_layers(6), **record["fidelity"]), record

    return load()


def test_compliance_of_a_loaded_tooth_and_its_neighbours_is_that_of_calculix(known):
    """Normal displacement over the loaded flank's grid; of the loaded tooth less that of the held tooth."""
    wheel, fidelity, record = known
    compliance = flank_compliance(wheel, fidelity, reach=1)
    for (row, level), column in zip(record["points"], record["columns"], strict=True):
        for tooth, true in zip((-1, 0, 1), column, strict=True):
            own = compliance.block(tooth, 0)[0, :, :, 0, row, level].ravel()
            np.testing.assert_allclose(own, true, atol=1e-6 * np.abs(true).max())


def test_stress_in_the_root_under_a_contact_line_with_friction_is_that_of_calculix(known):
    """Von Mises of the mean over bricks below both flanks; CalculiX's from the stress at its integration points."""
    wheel, fidelity, record = known
    pinion = GearBody(dataclasses.replace(wheel.geometry, helix_angle=-wheel.geometry.helix_angle))
    pair = GearPair(pinion, wheel, record["centre_distance"])
    force = np.array(record["slice_forces"])
    angle = record["mesh_periods"] * pair.mesh_period
    lines = contact_lines(pair, angle, slices=record["slices"])
    contact = LoadedMesh(lines, 0.0, force, np.zeros(len(force)), 0.0, (0.0, 0.0), 0.0)
    places = [RootElement(**place) for place in record["places"]]
    strain = nodal_force_strain(pair, WHEEL, places, (0,), [contact], fidelity, friction=record["friction"])[0, 0]
    np.testing.assert_allclose(von_mises(strain, wheel.material), record["von_mises"], rtol=1e-6)
