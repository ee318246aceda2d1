"""Rule for names from outside, which become files, table cells, labels and lines on a terminal.

Letters of any script are allowed. Separators, control characters, markup and names reserved by a file system are not.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable

from nvhchain.errors import printable as printable
from nvhchain.errors import require

LONGEST = 80
"""Largest length of a name (characters); its UTF-8 may take 1.5 times as many bytes.

Files add up to 60 bytes to a name, and file systems allow 255.
"""

LONGEST_TEXT = 1000
"""Largest number of characters of a text that is no name, such as a path."""

MARKS = " _-.,+=()[]#&°'"
"""Characters of a name besides letters and digits."""

_DEVICES = frozenset({"CON", "PRN", "AUX", "NUL", *(f"{port}{n}" for port in ("COM", "LPT") for n in range(10))})
"""Names reserved by Windows, with any ending."""


def check_name(name: object, subject: str) -> None:
    """Refuse (InputError) a name that cannot safely become a file, a table cell, a label or a printed line.

    subject : thing or field as the message calls it.
    """
    require(isinstance(name, str) and bool(name), f"{subject} = {_quoted(name)} must be a text of at least one letter")
    assert isinstance(name, str)
    size, most = len(name.encode(errors="replace")), LONGEST * 3 // 2
    require(
        len(name) <= LONGEST and size <= most,
        f"{subject} = {_quoted(name)} has {len(name)} characters in {size} bytes: at most {LONGEST} in {most}",
    )
    wrong = sorted({letter for letter in name if not _allowed(letter)})
    require(
        not wrong,
        f"{subject} = {_quoted(name)} holds {', '.join(map(ascii, wrong[:5]))}: "
        f"use letters, digits, blanks and {MARKS[1:]}",
    )
    require(
        name[0].isalnum() and name[-1] not in " .",
        f"{subject} = {_quoted(name)} must begin with a letter or digit and not end with a blank or dot",
    )
    require(not _device(name), f"{subject} = {_quoted(name)} is a device of some systems: choose another name")


def check_names(names: Iterable[object], subject: str) -> None:
    """Apply `check_name` to each name and require distinct ones, even if case and composition are ignored."""
    seen: dict[str, object] = {}
    for name in names:
        check_name(name, f"{subject}: name")
        key = folded(str(name))
        require(
            key not in seen,
            f"{subject}: names must be distinct, also where case is ignored, got {seen.get(key)!r} and {name!r}",
        )
        seen[key] = name


def folded(name: str) -> str:
    """Return a form that is equal for names of one file on some file system."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFD", name).casefold())


def safe_names(names: Iterable[str]) -> list[str]:
    """Return distinct names by the rule of `check_name` in place of names from another program."""
    safe: list[str] = []
    taken: set[str] = set()
    for name in names:
        plain = "".join(letter if _allowed(letter) else "_" for letter in name).strip(" .")
        plain = (plain if plain[:1].isalnum() and not _device(plain) else f"N{plain}")[: LONGEST // 2].rstrip(" .")
        unique, number = plain, 1
        while folded(unique) in taken:
            number += 1
            unique = f"{plain}-{number}"
        taken.add(folded(unique))
        safe.append(unique)
    return safe


def check_text(text: str, subject: str) -> None:
    """Refuse (InputError) control characters and excessive length in a text that is no name."""
    require(len(text) <= LONGEST_TEXT, f"{subject} is {len(text)} characters long: at most {LONGEST_TEXT}")
    require(
        printable(text) == text and not set("\n\t") & set(text),
        f"{subject} = {_quoted(text)} holds control characters: remove them",
    )


_UNSEEN = frozenset("\u115f\u1160\u17b4\u17b5\u3164\uffa0") | {chr(code) for code in range(0xFE00, 0xFE10)}
"""Letters and marks that print as nothing."""


def _allowed(letter: str) -> bool:
    return letter not in _UNSEEN and (letter.isalnum() or letter in MARKS or unicodedata.category(letter)[0] == "M")


def _device(name: str) -> bool:
    return unicodedata.normalize("NFKC", name).split(".")[0].rstrip().upper() in _DEVICES


def _quoted(name: object) -> str:
    """Return a name as it would be typed, on one line; the middle of a long one is omitted."""
    typed = repr(name)
    return typed if len(typed) <= LONGEST else f"{typed[: LONGEST // 2]}…{typed[-LONGEST // 4 :]}"
