"""Answers of commands as JSON: one object on stdout, errors included."""

from __future__ import annotations

import io
import json
import re
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nvhchain.cli.output import show

if TYPE_CHECKING:
    from nvhchain.chain.result import Result
    from nvhchain.doctor import Finding
    from nvhchain.scene.planned import Plan

_PLACE = re.compile(r"(?P<file>[^\n]*?):(?P<line>\d+): (?P<message>.*)", re.S)


def print_answer(answer: Mapping[str, Any], code: int) -> None:
    """Print an answer with its exit code as one JSON object; infinite and undefined numbers become null."""
    show(json.dumps(_plain({**answer, "exit_code": code}), ensure_ascii=False, indent=1))


def print_errors(messages: Iterable[str], code: int) -> None:
    """Print errors as one JSON object; a message with a place has its `file` and `line`."""
    errors = []
    for message in messages:
        found = _PLACE.fullmatch(message)
        errors.append({"message": message} if found is None else {**found.groupdict(), "line": int(found["line"])})
    print_answer({"errors": errors}, code)


def requested(arguments: Sequence[str]) -> bool:
    """Return True if arguments ask for JSON."""
    return "--json" in arguments


def parsed(words: ArgumentParser, arguments: Sequence[str]) -> Namespace | str:
    """Return the options, or the message of arguments that a parser refuses."""
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            return words.parse_args(arguments)
    except SystemExit as stop:
        if stop.code in (0, None):
            raise  # --help, --version
        return said.getvalue().strip()


def answered(action: Callable[[Namespace], int], options: Namespace) -> int:
    """Run the action of a command and print its answer in place of its text."""
    options.answer = {}
    with redirect_stdout(io.StringIO()):
        code = int(action(options))
    print_answer(options.answer, code)
    return code


def run_answer(result: Result, out: Path) -> dict[str, Any]:
    """Return levels with confidence limits of every quantity of a run."""
    import numpy as np

    names = [point.name for point in result.case.field_points]
    levels = {}
    for quantity, band in result.error_bands.items():
        overall = np.atleast_2d(band.overall)
        level = np.atleast_1d(result.overall if quantity == "pressure" else band.level)
        labels = names if quantity == "pressure" else [str(number) for number in range(len(level))]
        levels[quantity] = [
            {"name": name, "level_db": value, "limits_db": list(edges)}
            for name, value, edges in zip(labels, level, overall, strict=True)
        ]
    return {"case": result.case.name, "fidelity": result.fidelity.name, "folder": str(out), "levels": levels}


def plan_answer(plan: Plan) -> dict[str, Any]:
    """Return the steps of a plan with time and memory."""
    steps = [
        {
            "name": step.name,
            "models": step.models,
            "seconds": step.seconds,
            "megabytes": step.megabytes,
            "cached": step.result in plan.cached,
        }
        for step in plan.steps
    ]
    own = {"case": plan.case, "fidelity": plan.fidelity, "seconds": plan.seconds, "megabytes": plan.megabytes}
    return {
        **own,
        "steps": steps,
        "skipped": list(plan.skipped),
        "options": list(plan.options),
        "inputs": list(plan.inputs),
        "limits": list(plan.limits),
    }


def doctor_answer(findings: Iterable[Finding]) -> dict[str, Any]:
    """Return the findings of a diagnosis."""
    return {"findings": [asdict(finding) for finding in findings]}


def _plain(value: Any) -> Any:
    """Return a value in types that JSON has."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # of NumPy, which is not imported for this
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value
