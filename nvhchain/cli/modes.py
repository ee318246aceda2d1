"""Command `modes`."""

from __future__ import annotations

import argparse
from pathlib import Path

from nvhchain.cli.console import Console
from nvhchain.cli.output import show
from nvhchain.errors import require
from nvhchain.fidelity import PRESETS


def modes_command(options: argparse.Namespace) -> int:
    """Compute the modes of a gearbox under its torque, their shares of energy and a Campbell diagram."""
    from nvhchain.case import load_case
    from nvhchain.report import report_modes

    highest = options.highest
    require(highest is None or highest > 0.0, f"--highest = {highest} Hz must be positive")
    case = load_case(options.case, changes=options.set)
    out = Path(options.out or Path("out") / case.name)
    made = report_modes(
        case,
        out=out,
        fidelity=PRESETS[options.fidelity],
        highest=highest,
        damped=not options.undamped,
        watcher=Console(),
    )
    modes = made.modes
    options.answer = {
        "case": case.name,
        "input_torque_Nm": modes.input_torque,
        "input_speed_rad_s": modes.input_speed,
        "frequency_Hz": modes.frequency.tolist(),
        "damping_ratio": modes.damping.tolist(),
        "strain_energy": {part: modes.strain[:, i].tolist() for i, part in enumerate(modes.strain_parts)},
        "kinetic_energy": {part: modes.kinetic[:, i].tolist() for i, part in enumerate(modes.kinetic_parts)},
        "files": [str(path) for path in made.files],
    }
    show(f"{case.name} at {modes.input_torque:g} N m: {len(modes.frequency)} modes; those that strain the meshes most:")
    for line in made.lines:
        show(line)
    show(f"All modes and the Campbell diagram: {', '.join(map(str, made.files))}")
    return 0
