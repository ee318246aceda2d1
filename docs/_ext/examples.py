"""Examples of public names: their docstring, else a page, a script of cases/studies, or a test that uses them."""

import ast
import importlib
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
NAMES = [path.stem for path in sorted((ROOT / "docs" / "api").glob("*.rst"))]
PACKAGES = ["nvhchain", *(f"nvhchain.{name}" for name in NAMES if name != "nvhchain")]
"""Packages and modules with a page in docs/api."""


def used(source):
    """Full names that a script imports from nvhchain, or reaches through a package that it imports."""
    known, found = {"nvh": "nvhchain"}, set()
    nodes = list(ast.walk(ast.parse(source)))
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "nvhchain":
            known |= {each.asname or each.name: f"{node.module}.{each.name}" for each in node.names}
        elif isinstance(node, ast.Import):
            known |= {each.asname: each.name for each in node.names if each.asname}
    for node in nodes:
        if isinstance(node, ast.Name | ast.Attribute):
            first, _, rest = ast.unparse(node).partition(".")
            if first in known:
                found.add(f"{known[first]}.{rest}" if rest else known[first])
    return found


def blocks(page):
    """Blocks of Python on a page in Markdown."""
    return re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)


@cache
def uses():
    """Files that users may read, the simplest first, with the names that each uses."""
    pages = [path for path in sorted((ROOT / "docs").rglob("*.md")) if not {"decisions", "measured"} & {*path.parts}]
    found = [(path, used("\n".join(parts))) for path in pages if (parts := blocks(path.read_text(encoding="utf-8")))]
    tests = sorted((ROOT / "tests").rglob("test_*.py"), key=lambda path: (path.stat().st_size, path))
    scripts = [*sorted((ROOT / "cases").rglob("*.py")), *tests]
    return found + [(path, used(path.read_text(encoding="utf-8"))) for path in scripts]


def public():
    """Yield package, name and value of everything in the reference."""
    for package in PACKAGES:
        module = importlib.import_module(package)
        for name in module.__all__:
            yield package, name, getattr(module, name)


def example(package, name, value):
    """Where a public name is used: "docstring", or a path from the root of the repository; nothing without one."""
    if callable(value) and re.search(r"^ *(Examples$|>>> )", value.__doc__ or "", re.MULTILINE):
        return "docstring"
    home = getattr(value, "__module__", package)
    ways = {f"{at}.{name}" for at in (package, home, ".".join(home.split(".")[:2]))}
    for path, names in uses():
        if ways & names:
            return path.relative_to(ROOT).as_posix()
    return None
