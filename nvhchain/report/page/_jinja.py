"""Rendering of the page: templates of jinja2, scripts of Plotly."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from nvhchain import __version__
from nvhchain.names import printable


def rendered(title: str, sections: Sequence[tuple[str, str, Sequence[Any]]]) -> str:
    """Return the page."""
    environment = Environment(
        loader=PackageLoader("nvhchain.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value,
    )
    page = environment.get_template("page.html").render(
        title=title,
        sections=sections,
        version=__version__,
        style=_own("page.css"),
        script=_own("player.js") + _own("bodies.js") + _own("page.js") + _own("sorting.js"),
        plotly=Markup(get_plotlyjs().replace("</script", "<\\/script")),
    )
    return page


def _own(name: str) -> Markup:
    """Return a style sheet or script of this package."""
    return Markup(files("nvhchain.report.page").joinpath("templates", name).read_text(encoding="utf-8"))
