"""A casting without bolts: refused before any work where the gears would drive it, unless their forces are given."""

from pathlib import Path

import pytest

from nvhchain import cli
from nvhchain.case import load_case
from nvhchain.errors import InputError
from nvhchain.fidelity import DRAFT
from nvhchain.scene import check_knobs

CASE = Path(__file__).parents[2] / "cases" / "small" / "single_stage.toml"


def test_casting_that_nothing_holds_is_not_valid(tmp_path, capsys):
    file = tmp_path / "free.toml"
    text = CASE.read_text()
    assert text.count("\nbolts = ") == 1
    file.write_text(text.replace("\nbolts = ", "\nbolts = 0 # "))
    assert cli.main(["check", str(CASE)]) == 0
    assert cli.main(["check", str(file)]) == 2
    assert "housing bolts = 0" in capsys.readouterr().err
    free = load_case(file)
    with pytest.raises(InputError, match="housing bolts = 0"):
        check_knobs(free, DRAFT)
    check_knobs(free, DRAFT, {"force_spectrum"})
