"""Cases tried by the extremes suite: answered, refused and failed.

    NVHCHAIN_EXTREMES=200 python -m benchmarks extremes OUT [FILE ...]

Writes docs/measured/chain/extremes.md. Runs the test files named (none: all of tests/extremes), one after the other,
with so many new cases per test, and keeps their counts in OUT: one file at a time takes minutes. The page sums over
everything that OUT holds.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from benchmarks.publish import publish

ROOT = Path(__file__).parents[2]
SUITE = ROOT / "tests" / "extremes"
COUNTS = re.compile(r"^(test_\w+): (\d+) tried, (\d+) answered, (\d+) warned, (\d+) refused$", re.MULTILINE)
FAILED = re.compile(r"^(?:FAILED|ERROR) \S+::(test_\w+)", re.MULTILINE)


def run(file: Path, out: Path) -> None:
    """One test file; its counts go to OUT/<file>.json."""
    environment = {**os.environ, "NVHCHAIN_EXTREMES": os.environ.get("NVHCHAIN_EXTREMES", "200")}
    command = [sys.executable, "-m", "pytest", "-q", "-rfE", "-p", "no:cacheprovider", str(file)]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    counts = {name: [int(n) for n in numbers] for name, *numbers in COUNTS.findall(done.stdout)}
    if not counts:
        raise SystemExit(f"{file.name} tried nothing:\n{done.stdout[-3000:]}{done.stderr[-1000:]}")
    for name in counts:
        counts[name].append(int(name in FAILED.findall(done.stdout)))
    out.mkdir(parents=True, exist_ok=True)
    (out / f"{file.stem}.log").write_text(done.stdout, encoding="utf-8")
    (out / f"{file.stem}.json").write_text(json.dumps(counts), encoding="utf-8")


def page(out: Path) -> str:
    """Every test and the sums."""
    lines = [
        "Calls of a stage or a check, generated within and beyond sense; an answer is held against a closed form, a "
        "second way or finiteness, a refusal must name a value, and the limit or a remedy.",
        "",
        "| stage | claim | tried | answered | of these with a warning | refused | failed |",
        "|---|---|---:|---:|---:|---:|---:|",
    ]
    sums = [0] * 5
    for file in sorted(out.glob("test_*.json")):
        for name, counts in json.loads(file.read_text(encoding="utf-8")).items():
            claim = name.removeprefix("test_").replace("_", " ")
            lines.append(f"| {file.stem.removeprefix('test_')} | {claim} | " + " | ".join(map(str, counts)) + " |")
            sums = [total + count for total, count in zip(sums, counts, strict=True)]
    lines.append("| all | | " + " | ".join(map(str, sums)) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run, sum, write."""
    out, names = Path(sys.argv[1]), sys.argv[2:]
    for file in sorted(SUITE.glob("test_*.py")):
        if not names or file.name in names:
            run(file, out)
    publish("chain/extremes", page(out))


if __name__ == "__main__":
    main()
