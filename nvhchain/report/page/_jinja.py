"""Rendering of the page: templates of jinja2, scripts of Plotly."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from plotly.offline import get_plotlyjs

from nvhchain import __version__
from nvhchain.names import printable

_PIECES = (
    ("link.html", '<a href="#', "</a>", "</nav>"),
    ("section.html", '<section id="', "</section>", "</main>"),
)
"""Templates of a section, their first and last words on a page, and the end of all of them."""


def rendered(title: str, sections: Sequence[tuple[str, str, Sequence[Any]]]) -> str:
    """Return the page."""
    return (
        _environment()
        .get_template("page.html")
        .render(
            title=title,
            sections=sections,
            version=__version__,
            style=_own("page.css"),
            script=_own("player.js") + _own("bodies.js") + _own("page.js") + _own("sorting.js"),
            plotly=Markup(get_plotlyjs().replace("</script", "<\\/script")),
        )
    )


def renewed(page: str, sections: Sequence[tuple[str, str, Sequence[Any]]], order: Sequence[str]) -> str:
    """Return a page with some of its sections made anew; `order` has the names of all sections."""
    environment = _environment()
    for section in sections:
        later = "".join(f"|{re.escape(name)}" for name in order[order.index(section[0]) + 1 :])
        for template, start, end, last in _PIECES:
            made = environment.get_template(template).render(section=section, first=False)
            own = re.search(f'^{start}{section[0]}">.*?{end}\n', page, re.MULTILINE | re.DOTALL)
            after = re.search(f'^(?:{start}(?:-{later})">|{last})', page, re.MULTILINE)
            assert after is not None, "a page ends"
            begin, stop = own.span() if own else (after.start(), after.start())
            page = page[:begin] + made + page[stop:]
    return page


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("nvhchain.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value,
    )
    environment.filters["unbroken"] = _unbroken
    return environment


def _unbroken(sentence: str) -> Markup:
    """Return a sentence whose options of the command line stay in one row."""
    return Markup(re.sub(r"(--[a-z0-9-]+)", r'<span class="option">\1</span>', str(escape(printable(sentence)))))


def _own(name: str) -> Markup:
    """Return a style sheet or script of this package."""
    return Markup(files("nvhchain.report.page").joinpath("templates", name).read_text(encoding="utf-8"))
