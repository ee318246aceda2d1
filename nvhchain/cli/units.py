"""Commands `import` and `export`: gear units in REXS."""

from __future__ import annotations

import argparse

from nvhchain.cli.changes import changed_case
from nvhchain.cli.output import show
from nvhchain.errors import InputError, require


def import_unit(options: argparse.Namespace) -> int:
    """Write the case of a gear unit in REXS into a folder."""
    from nvhchain.case.rexs import import_rexs

    made = import_rexs(options.file, options.out, load=options.load_case, housing=options.housing)
    for line in made.lines:
        show(line)
    show(f"{made.case}; {made.page} lists everything with its value")
    show(f"Then: nvhchain check {made.case}; nvhchain run {made.case} --fidelity draft")
    return 0


def export_unit(options: argparse.Namespace) -> int:
    """Write a case as REXS, and name what the file does not hold."""
    from nvhchain.case import GearboxCase
    from nvhchain.case.rexs import export_rexs

    case = changed_case(options)
    if not isinstance(case, GearboxCase):
        raise InputError(f"{options.case}: {case.name} is a radiator: REXS holds gearboxes")
    require(options.out.suffix.lower() == ".rexs", f"--out {options.out}: REXS is written as XML: end it in .rexs")
    left = export_rexs(case, options.out)
    show(f"{options.out}; not in it: {', '.join(left)}")
    return 0
