"""Warnings of accuracy end a command: one line of each kind, with what it concerns."""

import warnings

from nvhchain.cli import commands, main
from nvhchain.cli.output import warning_lines
from nvhchain.errors import AccuracyWarning, concerning, warn_caller


def doubt(text, kind, *subjects):
    made = AccuracyWarning(text, kind)
    made.subjects = subjects
    return made


def test_one_line_of_each_kind_names_cases_and_steps():
    lines = list(
        warning_lines(
            [
                doubt("mesh is coarse: 1 dB", "mesh", "solid", "transfer_vectors"),
                doubt("point is near", "point", "solid", "pressure"),
                doubt("mesh is coarse: 2 dB", "mesh", "slotted", "transfer_vectors"),
                doubt("mesh is coarse: 1 dB", "mesh", "solid", "sound_power"),
            ]
        )
    )
    assert lines == [
        "solid (transfer_vectors, sound_power), slotted (transfer_vectors): mesh is coarse: 1 dB (1 more of this kind)",
        "solid (pressure): point is near",
    ]


def test_many_cases_are_counted_and_a_warning_outside_a_run_stands_alone():
    many = [doubt("coarse", "mesh", f"case {n}") for n in range(12)]
    assert list(warning_lines(many)) == ["case 0, case 1, case 2 and 9 more: coarse"]
    assert list(warning_lines([doubt("coarse", "")])) == ["coarse"]


def test_a_command_shows_them_at_its_end_also_where_it_fails(capsys, monkeypatch):
    def failing(_):
        for name in ("solid", "slotted"):
            with concerning(name):
                warn_caller("mesh is coarse", kind="mesh")
        print("levels")
        warnings.warn("beware", UserWarning, stacklevel=1)
        raise OSError("disk")

    monkeypatch.setattr(commands, "doctor", failing)
    assert main(["doctor"]) == 1
    printed = capsys.readouterr()
    assert printed.out == "levels\n"
    assert printed.err == "nvhchain: beware\nnvhchain: solid, slotted: mesh is coarse\nnvhchain: disk\n"


def test_without_a_name_messages_that_differ_in_numbers_alone_are_of_one_kind():
    few, many, other = (AccuracyWarning(text) for text in ("3 cracks of 0.2 mm", "12 cracks of 1.5 mm", "3 holes"))
    assert few.kind == many.kind != other.kind
