"""One box around the gears as a deck of solids and as one of shells: what radiates is the same."""

from dataclasses import replace

import numpy as np
import pytest

import nvhchain as nvh
from nvhchain.cli import main
from nvhchain.fidelity import DynamicsFidelity, HousingFidelity
from nvhchain.testing.decks import box_of_shells, box_of_solids, deck

CASE = """base = "{base}"
quantities = ["pressure"]
[band]
high = 2500
[housing]
type = "housing_model"
file = "{name}.bdf"
units = "mm-t-s"
"""


def written(request, folder, name, cards):
    base = request.config.rootpath / "cases/small/single_stage.toml"
    (folder / f"{name}.bdf").write_text(deck(cards))
    (folder / f"{name}.toml").write_text(CASE.format(base=base, name=name))
    return folder / f"{name}.toml"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*linear elements raised to quadratic", "ignore:rayleigh at")
def test_a_box_of_shells_sounds_like_the_box_of_solids(request, tmp_path, coarse):
    sound = replace(coarse.acoustics, elements_per_wavelength=6.0, radiation="rayleigh")
    housing = HousingFidelity(element_size=0.02, elements_per_turn=10)
    fidelity = replace(coarse, housing=housing, acoustics=sound, dynamics=DynamicsFidelity(time_step=20e-6))
    laws, levels, frequency = None, [], []
    for name, cards in (("solids", box_of_solids(0.0145)), ("shells", box_of_shells(0.009))):
        case = nvh.load_case(written(request, tmp_path, name, cards))
        result = nvh.run(case, fidelity=fidelity, mesh_laws=laws)
        laws = result.mesh_laws
        velocity = result.surface_velocity
        flux = float((np.abs(velocity.normal_velocity) ** 2 @ velocity.surface.areas).sum())
        levels.append(10 * np.log10([flux, float((np.abs(result.pressure.pressure) ** 2).sum())]))
        frequency.append(result.housing.natural_frequency[:6])
    assert np.abs(levels[1] - levels[0]).max() < 1.0
    assert frequency[1] == pytest.approx(frequency[0], rel=0.03)


def test_a_box_on_elastic_mounts_stands(request, tmp_path, capsys):
    cards = box_of_shells(0.012)
    feet = [card.split(",")[-1] for card in cards if card.startswith("SPC1")]
    assert len(feet) > 8
    free = [card for card in cards if not card.startswith("SPC1")]
    mounts = [f"CBUSH,{950000 + n},950,{foot},,,,,0" for n, foot in enumerate(feet)]
    case = str(written(request, tmp_path, "mounted", [*free, *mounts, "PBUSH,950,K,500.,500.,500."]))
    assert main(["check", case]) == 0
    case = str(written(request, tmp_path, "loose", free))
    assert main(["check", case]) == 2
    assert "loose.bdf holds no freedom" in capsys.readouterr().err


def test_plan_and_check_read_a_deck_of_shells(request, tmp_path, capsys):
    case = str(written(request, tmp_path, "shells", box_of_shells(0.012)))
    assert main(["check", case]) == 0
    assert main(["plan", case, "--fidelity", "draft"]) == 0
    assert "shells.bdf" in capsys.readouterr().out
