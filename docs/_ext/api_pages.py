"""Directive `package-api`: documents the names that a package offers in `__all__`, or those that a module defines."""

import importlib
import inspect

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective


def kind(value):
    """Directive of autodoc for a value."""
    if inspect.isclass(value):
        return "exception" if issubclass(value, Exception) else "class"
    return "function" if callable(value) else "data"


def documented(package, name, value):
    """Directive that documents a name; a reference where the package of its definition offers it, too."""
    home = ".".join(getattr(value, "__module__", package).split(".")[:2])
    if inspect.isclass(value) and home != package and name in getattr(importlib.import_module(home), "__all__", []):
        return f"``{package}.{name}``: see :class:`{home}.{name}`."
    return f".. auto{kind(value)}:: {package}.{name}"


class PackageApi(SphinxDirective):
    """Docstring of a package and of everything in its `__all__`."""

    required_arguments = 1

    def run(self):
        name = self.arguments[0]
        module = importlib.import_module(name)
        self.env.note_dependency(module.__file__)
        offered = getattr(module, "__all__", [])
        lines = [f".. automodule:: {name}", *(["   :no-members:"] if offered else []), ""]
        for one in offered:
            lines += [documented(name, one, getattr(module, one)), ""]
        content = nodes.Element()
        self.state.nested_parse(StringList(lines, source=name), 0, content)
        return content.children


def setup(app):
    app.add_directive("package-api", PackageApi)
    return {"parallel_read_safe": True}
