"""Commands on the sound of finished runs."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nvhchain.cli.output import show
from nvhchain.errors import require

if TYPE_CHECKING:
    from nvhchain.case import Case


def sound(options: argparse.Namespace) -> int:
    """Write sound files of a finished run or comparison."""
    from math import log10

    from nvhchain.conventions import REFERENCE_PRESSURE
    from nvhchain.report.sound.render import render_sounds

    require(
        options.full_scale is None or options.background not in (None, "case"),
        f"--full-scale {options.full_scale} belongs to a WAV file of --background: give one, or leave it out",
    )
    written = render_sounds(
        options.folder,
        point=options.point,
        only=options.only,
        excluded=options.without,
        background=options.background,
        full_scale=1.0 if options.full_scale is None else options.full_scale,
        seconds=options.seconds,
        universal=options.uff,
    )
    for path, made in written:
        level = 20 * log10(max(made.rms, 1e-300) / REFERENCE_PRESSURE)
        if options.uff:
            show(f"{path.with_suffix('.unv')}: all microphones; spectra of a steady sound in spectrum-*.unv")
        show(f"{path}: {made.seconds:.2f} s, {made.rms:.4g} Pa RMS, {level:.1f} dB re 20 µPa; sample 1.0 = 1 Pa")
    return 0


def microphones(options: argparse.Namespace) -> int:
    """Add microphones to a finished run or comparison."""
    from nvhchain.report import write_page
    from nvhchain.report.sound.microphones import BALLOON, MICROPHONES, add_microphones

    lines = add_microphones(
        options.folder, points=options.at, standard=options.standard, balloon=options.balloon, radius=options.radius
    )
    for line in lines:
        show(line)
    show(f"Page: {write_page(options.folder, added=(MICROPHONES, BALLOON))}")
    return 0


def hearing(options: argparse.Namespace) -> int:
    """Add loudness, sharpness, roughness and prominence to a finished run or comparison."""
    from nvhchain.report import write_page
    from nvhchain.report.sound.hearing import add_hearing

    for line in add_hearing(options.folder):
        show(line)
    show(f"Page: {write_page(options.folder)}")
    return 0


def check_enforced(enforce: bool, cases: Sequence[Case]) -> None:
    """Refuse `--enforce` for cases without a target."""
    require(
        not enforce or any(case.targets for case in cases),
        "--enforce: no case has a target: give [[targets]] with name and level in the case",
    )


def show_targets(summary: Mapping[str, Any], *, enforce: bool) -> int:
    """Print the judged targets of a summary; return 3 if one is not passed and `enforce` is given, else 0."""
    from nvhchain.report.sound.targets import target_sentence

    judged = [
        (name, one)
        for name, configuration in summary["configurations"].items()
        for one in configuration.get("targets", [])
    ]
    for name, target in judged:
        show(target_sentence(name, target))
    return 3 if enforce and not all(target["passed"] for _, target in judged) else 0


def add_commands(verbs: Any) -> None:
    """Add the commands on sound to the command line."""
    listen = verbs.add_parser("sound", help="write calibrated sound files (WAV) of a finished run, filtered by orders")
    listen.add_argument("folder", metavar="DIR", help="folder of `run` or `compare`")
    listen.add_argument("--point", metavar="NAME", help="microphone (default: the first)")
    orders = listen.add_mutually_exclusive_group()
    orders.add_argument(
        "--only", metavar="ORDER", type=float, nargs="+", default=[], help="orders of the input to keep"
    )
    orders.add_argument(
        "--without", metavar="ORDER", type=float, nargs="+", default=[], help="orders of the input to leave out"
    )
    listen.add_argument("--background", metavar="FILE", help="WAV file to add, or `case` for that of the case")
    listen.add_argument(
        "--full-scale",
        metavar="PA",
        type=float,
        help="pressure (Pa) of a sample of 1.0 of the background (default: 1)",
    )
    listen.add_argument(
        "--seconds", metavar="S", type=float, default=4.0, help="duration of a steady sound (default: 4)"
    )
    listen.add_argument(
        "--uff",
        action="store_true",
        help="universal files (dataset 58) of all microphones, too: signals and complex spectra",
    )
    listen.set_defaults(action=sound)

    heard = verbs.add_parser(
        "hearing", help="add loudness, sharpness, roughness and prominence of tones to a finished run (extra `sound`)"
    )
    heard.add_argument("folder", metavar="DIR", help="folder of `run` or `compare`")
    heard.set_defaults(action=hearing)

    added = verbs.add_parser(
        "microphones", help="add microphones to a finished run, from the waves of its sound power, in seconds"
    )
    added.add_argument("folder", metavar="DIR", help="folder of `run` or `compare`")
    added.add_argument(
        "--at",
        metavar=("X", "Y", "Z"),
        type=float,
        nargs=3,
        action="append",
        help="position (m) outside the sphere that encloses the housing (repeatable)",
    )
    array = added.add_mutually_exclusive_group()
    for standard in ("ISO 3744", "ISO 3745"):
        option = f"--{standard.lower().replace(' ', '')}"
        array.add_argument(option, dest="standard", action="store_const", const=standard, help=f"array of {standard}")
    added.add_argument("--balloon", action="store_true", help="levels in all directions, steps of 5 degrees")
    added.add_argument("--radius", metavar="M", type=float, help="radius (m) of array and balloon")
    added.set_defaults(action=microphones)
