"""One rule for names from outside: as files they stay in their folder, on a terminal they are only read."""

from __future__ import annotations

import random
import unicodedata

import pytest

from nvhchain.errors import InputError
from nvhchain.names import check_name, check_names, check_text, printable, safe_names

ESCAPE = "\x1b[2J"


@pytest.mark.parametrize(
    "name",
    ["stage 1", "A1", "Größe_2", "轴", "gear2-b.1", "rear 0.5 m", "45°, left", "Mic #1 (front)", "x" * 80],
)
def test_names_of_any_script_pass(name):
    check_name(name, "stage: name")


@pytest.mark.parametrize(
    "name",
    [
        "",
        7,
        None,
        "x/../../evil",
        "..",
        ".hidden",
        "-rf",
        "=1+1",
        "a\\b",
        "a\0b",
        f"a{ESCAPE}",
        "a\nb",
        "a\u202eb",
        "a\u2028b",
        "a\udc80b",
        "a:b",
        "<b>",
        "$x$",
        "a|b",
        "law-{key}",
        "end.",
        "end ",
        " A",
        "\u3164",
        "ab\u115f",
        "a\ufe0f",
        "NUL",
        "con.txt",
        "LPT1",
        "COM¹",
        "x" * 81,
        "轴" * 60,
    ],
)
def test_names_that_no_file_or_terminal_should_get_are_refused(name):
    with pytest.raises(InputError, match=r"^stage: name = ") as refused:
        check_name(name, "stage: name")
    assert str(refused.value).isprintable()


def _refusal(name):
    try:
        check_name(name, "n")
    except InputError as error:
        return str(error)
    return None


def test_random_names_either_pass_and_are_plain_or_are_refused_in_printable_words(tmp_path):
    rng = random.Random(33)
    letters = [*map(chr, range(0x300)), "/", "\\", "..", "\u202e", "轴", "\ud800", "\U0001f600"]
    passed = 0
    for _ in range(5000):
        name = "".join(rng.choices(letters, k=rng.randint(0, 4)))
        if (refusal := _refusal(name)) is not None:
            assert printable(refusal) == refusal
            continue
        passed += 1
        assert (tmp_path / f"law_{name}.h5").resolve().parent == tmp_path.resolve()
        assert printable(name) == name
    assert 100 < passed < 4900


@pytest.mark.parametrize("pair", [("A", "a"), ("é", "e\u0301"), ("Straße", "STRASSE")])
def test_names_of_one_file_on_some_file_system_are_refused_together(pair):
    with pytest.raises(InputError, match="must be distinct"):
        check_names(pair, "stages")
    check_names(("A", "B"), "stages")


def test_names_of_other_programs_become_distinct_names():
    given = ["SET/1", "SET:1", "$x$", ESCAPE, "", "a", "A", "NUL"]
    safe = safe_names(given)
    assert len(safe) == len(given)
    check_names(safe, "groups")
    assert safe_names(["SEAT_A1", "SKIN"]) == ["SEAT_A1", "SKIN"]


def test_texts_that_are_no_names_may_hold_separators_but_no_control_characters():
    check_text("../meshes/part 1.inp", "file")
    for text in ("a\0b", ESCAPE, "a\nb", "x" * 1001):
        with pytest.raises(InputError, match=r"^file"):
            check_text(text, "file")


def test_printed_text_holds_no_control_character_but_line_ends_and_tabs():
    everything = "".join(map(chr, range(0x11000)))
    shown = printable(everything)
    assert {letter for letter in shown if unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp")} == {
        "\n",
        "\t",
    }
    assert printable(ESCAPE) == r"\x1b[2J"
    assert printable("Größe … 轴\n") == "Größe … 轴\n"
