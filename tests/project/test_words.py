"""Rules of docs/developers/words.md that neither ruff nor numpydoc hold: first words, long sentences, names."""

import ast
import inspect
import re
from pathlib import Path

from numpydoc.docscrape import NumpyDocString

from scripts.docstrings import public

ROOT = Path(__file__).parents[2]
FIRST = r"(What|Of|Where|Whether|That|Those|As|So|How|From|On|With|To|By|In|Between|Beside|Behind)\b"
PREPOSITION = r"(about|above|across|after|along|around|as|at|before|behind|below|beside|between|beyond|by|for|from|in|"
PREPOSITION += (
    r"inside|into|like|near|of|off|on|outside|over|per|through|to|towards|under|until|up|with|within|without)(_|$)"
)
CONVERSIONS = (
    "HandOff.to_xarray as_json from_json Misalignment.in_plane SoundAccuracy.near_field_db"  # as in xarray; nouns
)


def docstrings(path):
    """Yield line and text of every docstring, those after assignments included."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        body = getattr(node, "body", ())
        for each in body if isinstance(body, list) else ():
            if isinstance(each, ast.Expr) and isinstance(getattr(each.value, "value", None), str):
                yield each.lineno, each.value.value.strip()


def members(name, value):
    """Return a public name and those that a class adds, with their values."""
    own = {**vars(value).get("__annotations__", {}), **vars(value)} if inspect.isclass(value) else {}
    return {name: value, **{f"{name}.{key}": member for key, member in own.items() if key[0] != "_"}}


def sentences(docstring):
    """Yield the sentences of a docstring, without formulas, tables, references and examples."""
    parsed = NumpyDocString(docstring)
    prose = ["\n".join(parsed[section]) for section in ("Summary", "Extended Summary", "Notes", "Warnings")]
    lists = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns")
    for block in prose + ["\n".join(entry.desc) for section in lists for entry in parsed[section]]:
        text = re.sub(r"`[^`]*`|\$[^$]*\$", "X", re.sub(r"(?m)^\s*(\||\.\. ).*$", "", block))
        for paragraph in re.split(r"\n\s*\n|\n\s*[-*] |\n(?=\w+(?:, \w+)* ?: )", text):
            yield from re.split(r"(?<=[.!?])\s+(?=[^a-z])", " ".join(paragraph.split()))


def word_count(sentence):
    return sum(bool(re.fullmatch(r"[A-Za-z’'–-]+", word)) for word in re.findall(r"[^\s(),;:.…]+", sentence))


def page_sentences(text):
    """Yield the sentences of a page in Markdown, without code, tables, headings and formulas. A colon ends one, too."""
    text = re.sub(r"(?ms)^(```+|~~~).*?^\1\s*$", "", text)
    text = re.sub(r"(?m)^\s*(\||#|:\w+:|<|!\[).*$", "", text)
    text = re.sub(r"(?s)\{\w+\}`[^`]*`|`[^`]*`|\$\$.*?\$\$|\$[^$]*\$", "X", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    for paragraph in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) ", text):
        yield from re.split(r"(?<=[.!?:])\s+(?=\S)", " ".join(paragraph.split()))


def test_docstrings_begin_with_a_verb_or_a_noun_phrase():
    found = []
    for path in sorted((ROOT / "nvhchain").rglob("*.py")):
        found += [f"{path.relative_to(ROOT)}:{n}: {t[:60]}" for n, t in docstrings(path) if re.match(FIRST, t)]
    assert not found, "\n".join(found)


def test_sentences_of_public_docstrings_have_at_most_25_words():
    found = []
    for name, value in public():
        for each, member in members(name, value).items():
            if inspect.isclass(member) or inspect.isroutine(member) or isinstance(member, property):
                lengths = {sentence: word_count(sentence) for sentence in sentences(inspect.getdoc(member) or "")}
                found += [f"{each}: {n} words: {sentence}" for sentence, n in lengths.items() if n > 25]
    assert not found, "\n".join(found)


def test_sentences_of_pages_have_at_most_25_words_and_a_subject():
    pages = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")] + sorted(
        path for path in (ROOT / "docs").rglob("*.md") if not {"_build", "measured"} & {*path.parts}
    )
    found = []
    for page in pages:
        for sentence in page_sentences(page.read_text(encoding="utf-8")):
            if word_count(sentence) > 25 or re.match(r"(Of|What|Whether) ", sentence):
                found.append(f"{page.relative_to(ROOT)}: {word_count(sentence)} words: {sentence}")
    assert not found, "\n".join(found)


def test_rejected_words_are_in_no_code_and_on_no_page():
    """One word for one thing: excluded, supplied, imported, checkpoints."""
    rejected = re.compile(r"\b(left out|ready-made|foreign|shards)\b", re.IGNORECASE)
    pages = [page for page in (ROOT / "docs").rglob("*.md") if not {"decisions", "measured", "_build"} & {*page.parts}]
    files = [*(ROOT / "nvhchain").rglob("*.py"), *pages, ROOT / "README.md"]
    assert len(files) > 700
    assert [str(file) for file in files if rejected.search(file.read_text(encoding="utf-8"))] == []


def test_no_function_begins_with_a_preposition():
    """Those of conversion, as in pandas, are words that readers know."""
    known = {"to_xarray", "to_dataframe", "as_json", "from_json"}
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "nvhchain").rglob("*.py"))
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    names = {node.name for tree in trees for node in ast.walk(tree) if isinstance(node, kinds)}
    assert len(names) > 3000
    assert {name for name in names - known if re.match(PREPOSITION, name.lstrip("_"))} == set()


def test_no_public_name_begins_with_a_preposition():
    names = {each for _, value in public() for each in members(value.__qualname__, value)}
    found = {name for name in names if re.match(PREPOSITION, name.rpartition(".")[2])}
    assert sorted(found - {*CONVERSIONS.split()}) == []


def test_no_variable_parameter_or_field_begins_with_a_preposition():
    """But words that alone say where or when (the mask `inside`), adjectives (near points), in-plane misalignment."""
    alone = {"inside", "outside", "above", "below", "before", "after", "on", "off", "up", "near", "in_plane"}
    found = []
    for path in sorted((ROOT / "nvhchain").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.arg):
                name = node.arg
            elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                name = node.id if isinstance(node, ast.Name) else node.attr
            else:
                continue
            word = name.lstrip("_").lower().removeprefix("near_")
            if word not in alone and re.match(PREPOSITION, word):
                found.append(f"{path.relative_to(ROOT)}:{node.lineno}: {name}")
    assert not found, "\n".join(found)
