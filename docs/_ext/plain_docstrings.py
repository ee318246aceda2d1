"""Docstrings are plain text with `name: meaning` entries; this turns them into reStructuredText."""

import re

NAMES = r"[A-Za-z_]\w*(?:, [A-Za-z_]\w*)*"
ENTRY = re.compile(rf"^(?P<name>{NAMES}): +(?P<text>\S.*)$")
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


def convert(lines):
    """reStructuredText lines for docstring `lines`."""
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
