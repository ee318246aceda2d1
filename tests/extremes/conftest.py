"""How many cases are tried: few and always the same ones with the other tests, many and new ones by `make extremes`.

`make extremes` sets NVHCHAIN_EXTREMES to the number of cases per test.
"""

import re
import warnings
from collections import Counter

import pytest
from hypothesis import HealthCheck, settings

from nvhchain.errors import AccuracyWarning, InputError, SolverError
from nvhchain.testing.scales import MANY

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


_VALUE = re.compile(r"\d|\bnan\b|\binf\b|'[^']*'|\b(None|True|False)\b")
_ADMITTED = re.compile(
    r"\b(outside|at least|at most|must|need(s|ed)?|below|above|beyond|between|more than|less than|wider|narrower|"
    r"reach(es)?|limit|only|cannot|known|unknown|expected|instead of|inside|behind|overlaps?|has no)\b|…|±"
)
_REMEDY = re.compile(
    r"[:;,] (or )?(\w+ )?(give|use|choose|flip|raise|lower|reduce|remove|keep|make|move|refine|add|drop|ask|check|"
    r"widen|coarsen|shorten|replace|turn|leave|lengthen|narrow|enlarge|thicken|sample|record|set|name|put|take|cut|split|tabulate)\b"
)


def says_why(text):
    """Whether words name a value, and what is admitted in its place or what to do."""
    return bool(_VALUE.search(text) and (_ADMITTED.search(text) or _REMEDY.search(text)))


@pytest.fixture
def tried(request):
    """Calls something that must end well: its result, or None where it was refused in words (`says_why`).

    Answers with an AccuracyWarning, which must name a value too, are held to be right like all others.
    """
    name = request.node.originalname or request.node.name

    def call(function, *arguments, **options):
        ENDINGS[name, "tried"] += 1
        refusal = ""
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", AccuracyWarning)
            try:
                result = function(*arguments, **options)
            except (InputError, SolverError) as error:
                refusal = str(error)
        if refusal:
            ENDINGS[name, "refused"] += 1
            assert says_why(refusal), f"names no value, or neither limit nor remedy: {refusal}"
            return None
        for warning in said:
            if not issubclass(warning.category, AccuracyWarning):
                warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
            assert _VALUE.search(str(warning.message)), f"names no value: {warning.message}"
        ENDINGS[name, "answered"] += 1
        ENDINGS[name, "warned"] += any(issubclass(warning.category, AccuracyWarning) for warning in said)
        return result

    return call


def pytest_terminal_summary(terminalreporter):
    """Cases tried, answered and refused by every test."""
    if not MANY:
        return
    terminalreporter.section("extremes")
    for name in sorted({name for name, _ in ENDINGS}):
        counts = {ending: ENDINGS[name, ending] for ending in ("tried", "answered", "warned", "refused")}
        terminalreporter.line(f"{name}: " + ", ".join(f"{count} {ending}" for ending, count in counts.items()))
