"""How many cases are tried: few and always the same ones with the other tests, many and new ones by `make extremes`.

`make extremes` sets NVHCHAIN_EXTREMES to the number of cases per test.
"""

import os
import sys
import warnings
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from nvhchain.errors import AccuracyWarning, InputError, SolverError

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]  # scales.py, moved_gearbox.py

MANY = int(os.environ.get("NVHCHAIN_EXTREMES", "0"))
ENDINGS = Counter()

settings.register_profile(
    "extremes",
    max_examples=MANY or 12,
    derandomize=not MANY,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.filter_too_much],
)
settings.load_profile("extremes")


@pytest.fixture
def tried(request):
    """Calls something that must end well: its result, or None where it was refused in words that name a value."""
    name = request.node.originalname or request.node.name

    def call(function, *arguments, **options):
        ENDINGS[name, "tried"] += 1
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            try:
                result = function(*arguments, **options)
            except (InputError, SolverError) as refusal:
                ENDINGS[name, "refused"] += 1
                text = str(refusal)
                assert len(text) > 15
                assert any(c.isdigit() for c in text) or "'" in text, f"names neither value nor limit: {text}"
                return None
        ENDINGS[name, "answered"] += 1
        return result

    return call


def pytest_terminal_summary(terminalreporter):
    """Cases tried, answered and refused by every test."""
    if not MANY:
        return
    terminalreporter.section("extremes")
    for name in sorted({name for name, _ in ENDINGS}):
        counts = {ending: ENDINGS[name, ending] for ending in ("tried", "answered", "refused")}
        terminalreporter.line(
            f"{name}: {counts['tried']} tried, {counts['answered']} answered, {counts['refused']} refused"
        )
