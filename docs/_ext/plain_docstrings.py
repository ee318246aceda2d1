"""Conversion of docstrings to reStructuredText: numpydoc sections, plain text, and entries `name: meaning`."""

import re
from inspect import cleandoc

NAMES = r"[A-Za-z_]\w*(?:, [A-Za-z_]\w*)*"
ENTRY = re.compile(rf"^(?P<name>{NAMES}): +(?P<text>\S.*)$")
TITLED = re.compile(r"^-{3,}$")
LISTED = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns")
"""Numpydoc sections that list entries."""

SPLIT = re.compile(rf"(?<=\S)  (?={NAMES}: )")
"""Two blanks separate entries that share a line."""


def escape(text):
    """Protect everything that reStructuredText would read as markup; `code` stays code."""
    parts = re.split(r"(`+[^`]+`+)", text)
    for i, part in enumerate(parts):
        if i % 2:
            parts[i] = "``" + part.strip("`") + "``"
            if i + 1 < len(parts) and re.match(r"\w", parts[i + 1]):
                parts[i] += "\\ "
            if parts[i - 1] and re.search(r"\w$", parts[i - 1]):
                parts[i] = "\\ " + parts[i]
        else:
            parts[i] = re.sub(r"([\\*|_`<>])", r"\\\1", part)
    return "".join(parts)


def paragraphs(lines):
    """Blocks of lines between blank ones."""
    block = []
    for line in [*lines, ""]:
        if line.strip():
            block.append(line)
        elif block:
            yield block
            block = []


def sections(lines):
    """Return (title, lines) of every numpydoc section; the title of the text before them is empty."""
    result = [("", [])]
    for line in lines:
        if TITLED.match(line) and result[-1][1] and result[-1][1][-1]:
            result.append((result[-1][1].pop(), []))
        else:
            result[-1][1].append(line.rstrip())
    return result


def listed(lines):
    """Return (names, type, meaning) of every entry of a numpydoc section."""
    result = []
    for line in lines:
        if line and not line.startswith(" "):
            names, _, kind = line.partition(" : ")
            result.append([names, kind, ""])
        elif line.strip() and result:
            result[-1][2] = f"{result[-1][2]} {line.strip()}".strip()
    return result


def fields(cls):
    """Return field name → meaning of the numpydoc entries in the docstrings of `cls` and its bases."""
    found = {}
    for base in reversed(cls.__mro__):
        for title, lines in sections(cleandoc(base.__doc__ or "").splitlines()):
            if title in ("Parameters", "Attributes"):
                found |= {name: text for names, _, text in listed(lines) for name in names.split(", ")}
    return found


def convert(lines):
    """Return the reStructuredText lines of docstring `lines`."""
    result = []
    for title, part in sections(lines):
        if title:
            result += [f"**{title}**", ""]
        if title not in LISTED:
            result += plain_text(part)
            continue
        for names, kind, text in listed(part):
            shown = f"**{escape(names)}**" + (f" ({escape(kind)})" if kind else "")
            result += [f"* {shown} – {escape(text)}" if text else f"* {shown}"]
        result.append("")
    return result


def plain_text(lines):
    """Return the reStructuredText lines of paragraphs and of entries `name: meaning`."""
    result = []
    for block in paragraphs(lines):
        entries, plain = [], []
        for line in block:
            for piece in SPLIT.split(line.rstrip()):
                found = ENTRY.match(piece)
                if found:
                    entries.append([found["name"], found["text"]])
                elif entries:
                    entries[-1][1] += " " + piece.strip()
                else:
                    plain.append(piece.strip())
        if plain:
            result += [escape(" ".join(plain)), ""]
        for name, text in entries:
            result += [f"* **{escape(name)}** – {escape(text)}"]
        if entries:
            result.append("")
    return result


def process(app, what, name, obj, options, lines):
    if what == "module" and lines:
        # "Levels: decibels, …" is a title here, not an entry.
        lines[:] = [escape(lines[0]), "", *convert(lines[1:])]
    else:
        lines[:] = convert(lines)


def setup(app):
    app.connect("autodoc-process-docstring", process)
    return {"parallel_read_safe": True}
