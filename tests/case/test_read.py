"""Files that are no cases."""

import pytest

from nvhchain.case import load_case
from nvhchain.case.toml import read
from nvhchain.errors import InputError


def test_a_device_without_end_is_refused():
    with pytest.raises(InputError, match="/dev/zero: more than 64 MB: give a file in TOML"):
        load_case("/dev/zero")


def test_line_ends_of_windows_are_those_of_other_systems(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xef\xbb\xbfa = 1\r\nb = '''x\r\ny'''\r\n")
    assert read.read_toml(tmp_path / "a.toml") == ({"a": 1, "b": "x\ny"}, "a = 1\nb = '''x\ny'''\n")
