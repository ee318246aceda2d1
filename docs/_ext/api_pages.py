"""Directive `package-api`: documents the names that a package offers in `__all__`, each with a link to an example."""

import importlib
import inspect

from docutils import nodes
from docutils.statemachine import StringList
from examples import example
from sphinx.util.docutils import SphinxDirective

LONGEST = 100
"""Longest value (characters) that a page prints."""


def kind(value):
    """Directive of autodoc for a value."""
    if inspect.isclass(value):
        return "exception" if issubclass(value, Exception) else "class"
    return "function" if callable(value) else "data"


def linked(package, name, value):
    """Line that leads to an example; none where the docstring holds it."""
    path = example(package, name, value)
    if path in (None, "docstring"):
        return []
    page, mark, _ = path.removeprefix("docs/").partition(".md")
    return ["", f"   Example: :doc:`/{page}`" if mark else f"   Example: :download:`{path} </../{path}>`"]


def shortened(value):
    """Option that replaces a long value, such as that of a preset, by its class and name."""
    if kind(value) != "data" or len(repr(value)) <= LONGEST:
        return []
    called = f"{value.name!r}, " if isinstance(getattr(value, "name", None), str) else ""
    return [f"   :annotation: = {type(value).__name__}({called}…)"]


class PackageApi(SphinxDirective):
    """Docstring of a package and of everything in its `__all__`."""

    required_arguments = 1

    def run(self):
        name = self.arguments[0]
        module = importlib.import_module(name)
        self.env.note_dependency(module.__file__)
        lines = [f".. automodule:: {name}", "   :no-members:", ""]
        members = {one: getattr(module, one) for one in module.__all__}
        for one, value in sorted(members.items(), key=lambda item: kind(item[1]) == "data"):
            lines += [f".. auto{kind(value)}:: {name}.{one}", *shortened(value), *linked(name, one, value), ""]
        content = nodes.Element()
        self.state.nested_parse(StringList(lines, source=name), 0, content)
        return content.children


def setup(app):
    app.add_directive("package-api", PackageApi)
    return {"parallel_read_safe": True}
