"""Command line of the gallery: `python -m nvhchain.gallery`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from nvhchain.cli import reported
from nvhchain.cli.arguments import Parser, folder
from nvhchain.cli.examples import examples_folder
from nvhchain.cli.output import show
from nvhchain.fidelity import PRESETS


def main(arguments: Sequence[str] | None = None) -> int:
    """Make figures and tables of the thesis.

    arguments: arguments; those of the process by default.
    """
    return reported(_parser(), arguments)


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="nvhchain.gallery", description="Figures and tables of the thesis, chapters 3 to 5.")
    parser.add_argument("numbers", metavar="NUMBER", nargs="*", help='such as 5.7 or "table 3.2" (default: all)')
    parser.add_argument("--out", metavar="DIR", type=folder, default="out/gallery", help="default: out/gallery")
    parser.add_argument("--fidelity", choices=list(PRESETS), default="standard", help="accuracy preset")
    parser.add_argument(
        "--cases", metavar="DIR", type=Path, default=examples_folder() / "gearbox", help="folder of the gearbox cases"
    )
    parser.set_defaults(action=_gallery)
    return parser


def _gallery(options: argparse.Namespace) -> int:
    from nvhchain.gallery.making import made_items
    from nvhchain.gallery.page import write_pages
    from nvhchain.gallery.registry import ITEMS, chosen

    wanted, out = {item.number for item in chosen(options.numbers)}, Path(options.out)
    made = made_items(
        ITEMS,
        out,
        fidelity=PRESETS[options.fidelity],
        cases=options.cases,
        wanted=wanted,
        progress=lambda line: show(line, error=True),
    )
    for page in write_pages(made, out):
        show(page)
    for failed in (each.failure for each in made if each.failure):
        raise failed
    return 0


if __name__ == "__main__":
    if not sys.flags.safe_path and sys.path[0] == os.getcwd():
        del sys.path[0]  # the working directory, whose files are no modules of ours
    sys.exit(main())
