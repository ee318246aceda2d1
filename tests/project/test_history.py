"""Provenance is history: nothing computes from it."""

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "nvhchain"

PRINTERS = {
    "files",  # writes it, and finds files by the key in it
    "report/page/sections/making.py",  # prints it
    "cli",
    "handoff/base.py",  # hands it to a copy
}


def readings(source):
    """Lines that look into a provenance: by key, by name of an entry, or by what it holds."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
            inside = [node.value]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            inside = [node.func.value]
        elif isinstance(node, ast.Compare):
            inside = node.comparators
        elif isinstance(node, ast.For | ast.comprehension):
            inside = [node.iter]
        else:
            continue
        if any("provenance" in (getattr(of, "attr", ""), getattr(of, "id", "")) for of in inside):
            yield ast.unparse(node)


def test_nothing_computes_from_provenance():
    found = {
        str(path.relative_to(PACKAGE)): read
        for path in PACKAGE.rglob("*.py")
        if not {path.relative_to(PACKAGE).parts[0], path.relative_to(PACKAGE).as_posix()} & PRINTERS
        if (read := [*readings(path.read_text(encoding="utf-8"))])
    }
    assert found == {}


def test_every_way_to_look_into_a_provenance_is_seen():
    for look in (
        "x = of.provenance['a']",
        "x = of.provenance.get('a')",
        "x = 'a' in of.provenance",
        "x = [a for a in of.provenance]",
        "x = provenance['a']",
        "for a in of.provenance.items(): pass",
    ):
        assert [*readings(look)], look
    assert not [*readings("made = of.provenance | {'stage': 'x'}")]
