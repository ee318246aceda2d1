"""Example cases that `nvhchain new` copies."""

import errno

import pytest

from nvhchain.case import load_case
from nvhchain.cli import examples, main
from nvhchain.cli.examples import EXAMPLES
from nvhchain.scene import check_case


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_copied_example_is_a_valid_case_by_itself(name, tmp_path, capsys):
    assert main(["new", name, str(tmp_path / "mine")]) == 0
    printed = capsys.readouterr().out
    case = tmp_path / "mine" / EXAMPLES[name][0].rsplit("/")[-1]
    check_case(load_case(case))
    assert f"nvhchain check {case}" in printed


def test_a_file_that_is_there_is_never_replaced(tmp_path, capsys):
    (tmp_path / "solid.toml").write_text("mine")
    assert main(["new", "slotted", str(tmp_path)]) == 2
    assert "solid.toml exists" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["solid.toml"]
    assert (tmp_path / "solid.toml").read_text() == "mine"


def test_a_full_disk_leaves_no_part_of_an_example(tmp_path, monkeypatch, capsys):
    whole, tried = examples.write_output, []

    def limited(path, content):
        tried.append(path)
        if len(tried) == 3:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return whole(path, content)

    monkeypatch.setattr(examples, "write_output", limited)
    assert main(["new", "slotted", str(tmp_path / "mine")]) == 1
    assert "No space left" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["case.schema.json"]
    assert main(["new", "slotted", str(tmp_path / "mine")]) == 0
