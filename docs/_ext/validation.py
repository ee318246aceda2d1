"""Directive `validation`: checks by package, each dated by the head of its measured page, with its tests."""

import re

from docutils import nodes
from field_tables import inline, section, table
from rooms import ROOT
from sphinx import addnodes
from sphinx.util.docutils import SphinxDirective


def measured(page):
    """Date and commit at the head of a page below docs/measured; empty without a page."""
    if not page:
        return ""
    text = (ROOT / "docs" / "measured" / f"{page}.md").read_text(encoding="utf-8")
    found = re.search(r"easured (\d{4}-\d\d-\d\d) at commit (\w+)", text)
    return f"{found[1]}, {found[2]}"


def cell(text, page=""):
    """Paragraph of a cell; of a measured page a link to the page of the documentation that includes it."""
    if not page:
        return nodes.paragraph("", "", *inline(text))
    package = page.split("/")[0]
    link = addnodes.pending_xref(
        "",
        nodes.inline(text=text),
        refdomain="std",
        reftype="doc",
        reftarget=f"/validation/{package}",
        refexplicit=True,
        refwarn=True,
    )
    return nodes.paragraph("", "", link)


class Validation(SphinxDirective):
    """One table per line `## package`; rows are `claim | checked against | measured page | test`."""

    has_content = True

    def run(self):
        rows = {}
        for line in filter(str.strip, self.content):
            if line.startswith("## "):
                package = rows[line[3:]] = []
                continue
            claim, against, page, test = (text.strip() for text in line.split("|"))
            if page:
                self.env.note_dependency(str(ROOT / "docs" / "measured" / f"{page}.md"))
            if not (ROOT / test).exists():
                raise self.error(f"{test} does not exist")
            package.append((claim, against, page, test))
        return [
            section(title, f"validation-{title.split()[0].lower()}", checks(found)) for title, found in rows.items()
        ]


def checks(rows):
    """Table of the checks of a package."""
    texts = [[claim, against, measured(page) or "in the tests", f"`{test}`"] for claim, against, page, test in rows]
    made = table(["step", "checked against", "measured", "tests"], texts)
    (body,) = made.findall(nodes.tbody)
    for line, text, row in zip(body, texts, rows, strict=True):
        line[0].children, line[2].children = [cell(text[0])], [cell(text[2], row[2])]
    return made


def setup(app):
    app.add_directive("validation", Validation)
    return {"parallel_read_safe": True}
