"""Directive `rooms`: the packages in the layers of the import contract, drawn from pyproject.toml and docstrings."""

import ast
import html
import re
import textwrap
import tomllib
from pathlib import Path

from docutils import nodes
from field_tables import inline
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
WIDTH, LINE, GAP, LETTER = 900, 17, 7, 6.8
"""px: width of the picture, height of a line of text, space between boxes, width of a letter."""


def contracts():
    """Container → its layers from the top, each a list of names."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return {
        contract["containers"][0]: [re.findall(r"\w+", layer) for layer in contract["layers"]]
        for contract in settings["tool"]["importlinter"]["contracts"]
        if contract["type"] == "layers"
    }


def purpose(name):
    """First sentence of the docstring of a module."""
    path = ROOT.joinpath(*name.split("."))
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or ""
    return re.split(r"(?<=[a-z0-9)`][.]) ", " ".join(text.split("\n\n")[0].split()))[0]


def exists(name):
    """Whether a layer of the contract has a module yet."""
    path = ROOT.joinpath(*name.split("."))
    return path.is_dir() or path.with_suffix(".py").exists()


def picture(layers, inner):
    """SVG: a row of boxes per layer, and in each box a line per layer of its rooms, the highest first."""
    shapes, y = [], 0
    for row in layers:
        width = (WIDTH - GAP * (len(row) - 1)) / len(row)
        letters = int((width - 2 * GAP) / LETTER)
        rooms = {
            name: [
                line
                for layer in inner.get(f"nvhchain.{name}", [])
                for line in textwrap.wrap(" · ".join(layer), letters, break_long_words=False)
            ]
            for name in row
        }
        height = LINE * (1 + max(len(lines) for lines in rooms.values())) + 2 * GAP
        for i, (name, lines) in enumerate(rooms.items()):
            x = i * (width + GAP)
            shapes.append(
                f'<rect x="{x:.1f}" y="{y}" width="{width:.1f}" height="{height}" rx="4" '
                'fill="currentColor" fill-opacity="0.06" stroke="currentColor" stroke-opacity="0.4"/>'
            )
            for number, text in enumerate([name, *lines]):
                weight, size = ("normal", 12) if number else ("bold", 13)
                shapes.append(
                    f'<text x="{x + GAP:.1f}" y="{y + GAP + LINE * (number + 0.8):.1f}" font-size="{size}" '
                    f'font-weight="{weight}" fill="currentColor">{html.escape(text)}</text>'
                )
        y += height + GAP
    return (
        f'<svg viewBox="-1 -1 {WIDTH + 2} {y + 2}" role="img" style="max-width: 100%" '
        f'aria-label="Packages of nvhchain in the layers of their imports">{"".join(shapes)}</svg>'
    )


class Rooms(SphinxDirective):
    """The picture, and a list of all rooms with their purpose."""

    def run(self):
        found = contracts()
        layers = [[name for name in row if exists(f"nvhchain.{name}")] for row in found["nvhchain"]]
        listed = nodes.bullet_list()
        for name in (name for row in layers for name in row):
            item = nodes.list_item()
            text = nodes.paragraph()
            text += [nodes.literal(text=name), nodes.Text(": "), *inline(purpose(f"nvhchain.{name}"))]
            item += text
            rooms = [room for row in found.get(f"nvhchain.{name}", []) for room in row]
            if rooms:
                inside = nodes.bullet_list()
                for room in rooms:
                    line = nodes.paragraph()
                    line += [nodes.literal(text=room), nodes.Text(": "), *inline(purpose(f"nvhchain.{name}.{room}"))]
                    inside += nodes.list_item("", line)
                item += inside
            listed += item
        return [nodes.raw("", picture([row for row in layers if row], found), format="html"), listed]


def setup(app):
    app.add_directive("rooms", Rooms)
    return {"parallel_read_safe": True}
