"""Units of responses, on axes and of differences."""

import pytest

from nvhchain.study.responses import response_title


@pytest.mark.parametrize(
    ("name", "title", "difference"),
    [
        ("level", "level / dB(A)", "level / dB"),
        ("sound_power", "sound_power / dB", "sound_power / dB"),
        ("order 20", "order 20 / dB", "order 20 / dB"),
        ("loudness_sone", "loudness / sone", "loudness / sone"),
        ("inertia_kg_m2", "inertia / kg m²", "inertia / kg m²"),
        (
            "transmission_error_um of stage_kg",
            "transmission error of stage_kg / µm",
            "transmission error of stage_kg / µm",
        ),
        ("contact_pressure_MPa of low_um", "contact pressure of low_um / MPa", "contact pressure of low_um / MPa"),
        ("ratio", "ratio", "ratio"),
    ],
)
def test_the_unit_of_a_response_is_of_its_quantity_and_not_of_its_stage(name, title, difference):
    assert response_title(name) == title
    assert response_title(name, difference=True) == difference
