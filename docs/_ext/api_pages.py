"""Directive `api-modules`: documents every public module of the package, in the order of the import contract."""

import pkgutil

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

import nvhchain

LOWEST_FIRST = """
    errors conventions fidelity handoff store levels fem resume gear lumped dynamics spectrum housing acoustics interop
    case scene radiator chain plots report study tradeoff doctor cli
"""


def public_modules():
    """Dotted names of all modules without a leading underscore anywhere."""
    names = [m.name for m in pkgutil.walk_packages(nvhchain.__path__, "nvhchain.") if "._" not in m.name]
    rank = {name: i for i, name in enumerate(LOWEST_FIRST.split())}
    return sorted(names, key=lambda name: (rank.get(name.split(".")[1], len(rank)), name))


class ApiModules(SphinxDirective):
    """One section per module."""

    def run(self):
        sections = []
        for name in public_modules():
            section = nodes.section(ids=[name.replace(".", "-")], names=[name])
            section += nodes.title(text=name)
            self.state.nested_parse(StringList([f".. automodule:: {name}", ""], source="api"), 0, section)
            sections.append(section)
        return sections


def setup(app):
    app.add_directive("api-modules", ApiModules)
    return {"parallel_read_safe": True}
