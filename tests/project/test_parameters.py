"""Functions take at most eight parameters; compiled kernels, which take arrays one by one, are excepted."""

import ast
from pathlib import Path

import pytest

MOST = 8
PACKAGE = Path(__file__).parents[2] / "nvhchain"
COMPILERS = {"njit", "jit", "inline", "compiled", "_loop"}


def names(tree):
    return {getattr(node, "id", None) or getattr(node, "attr", None) for node in ast.walk(tree)}


def parameters(function):
    taken = function.args
    every = [*taken.posonlyargs, *taken.args, *taken.kwonlyargs, taken.vararg, taken.kwarg]
    return [of.arg for of in every if of is not None and of.arg not in ("self", "cls")]


def too_long(*texts):
    """Return names of functions with more parameters that are neither decorated with a compiler nor handed to one."""
    nodes = [node for text in texts for node in ast.walk(ast.parse(text))]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    handed = [of.args for of in nodes if isinstance(of, ast.Call) and of.args and names(of.func) & COMPILERS]
    kernels = {getattr(argument, "id", None) for arguments in handed for argument in arguments}
    return [
        of.name
        for of in functions
        if len(parameters(of)) > MOST
        and of.name not in kernels
        and not any(names(decorator) & COMPILERS for decorator in of.decorator_list)
    ]


def test_functions_take_at_most_eight_parameters():
    found = too_long(*(path.read_text() for path in PACKAGE.rglob("*.py")))
    assert found == [], "group what belongs together into a frozen dataclass, or split the function"


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        ("", "", ["f"]),
        ("@checked\n", "", ["f"]),
        ("@nb.njit(cache=True)\n", "", []),
        ("@inline\n", "", []),
        ("", "\ng = nb.njit(KIND)(f)", []),
    ],
)
def test_nine_are_too_many_except_in_kernels(before, after, found):
    assert too_long(f"{before}def f(a, b, c, d, *, e, g, h, i, **j): ...{after}") == found
    assert too_long("def f(self, a, b, c, d, *, e, g, h, i): ...") == []
