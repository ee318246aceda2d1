"""Damage to files: cut off, bits turned, numbers exchanged, bytes lost or read as text for binary."""

from __future__ import annotations

import json
import random
import re
from typing import Any

NUMBER = re.compile(rb"(?<![A-Za-z_])[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")
WRONG = (
    b"-1",
    b"0",
    b"nan",
    b"inf",
    b"1e400",
    b"1e300",
    b"99999999999999999999",
    b"2147483648",
    b"30000000",
    b"1.5",
    b"x",
)
CONTROLS = (b"\x1b[2J", b"\r", b"\0", b"\x7f", "\u202e".encode(), b"\x9b2J", b"\xff\xfe")
"""What a terminal takes for an order, and bytes that are no text."""

_FORMS = ((b"ASCII", b"BINARY"), (b"BINARY", b"ASCII"), (b"ascii", b"binary"), (b"UInt64", b"UInt32"))


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Return the file cut off, with bits turned, numbers exchanged, bytes lost, or read as text for binary and back."""
    if not data:
        return rng.choice(CONTROLS)
    at = rng.randrange(len(data))
    found = list(NUMBER.finditer(data[:2000]))
    kind = rng.randrange(8)
    if kind == 7:
        return data[:at] + rng.choice(CONTROLS) + data[at:]
    if kind == 0:
        return data[:at]
    if kind == 1:
        return with_bit_turned(data, at, rng)
    if kind == 2 and found:
        number = rng.choice(found)
        return data[: number.start()] + rng.choice(WRONG) + data[number.end() :]
    if kind == 3:
        return data[:at] + data[at + rng.randrange(1, 200) :]
    if kind == 4:
        value = rng.choice((b"\xff" * 4, b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b"\0" * 8))
        return data[:at] + value + data[at + len(value) :]
    if kind == 5:
        for ours, others in _FORMS:
            if ours in data:
                return data.replace(ours, others)
    return rng.choice((b"", b"\n", rng.randbytes(300)))


def with_bit_turned(data: bytes, at: int, rng: random.Random) -> bytes:
    """Return the file with one bit of byte `at` turned."""
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


_VALUE = re.compile(r'(?<= = )("[^"\n]*"|-?[\d.]+|\[[^\[\]{}\n]*\]|\{[^{}\n]*\})')
_ODD = [
    "1e12", "-1", "0", "nan", "inf", "-inf", "1e-30", "1e308",
    "-0.0", "9" * 30, "0x10", "true", "[]", "[[]]", "{}", '""',
    '"A"', '"\\u001b[2J"', '"x/../../evil"', "1979-05-27", '"""', "[1, 2, 3]", "[nan, 0, 0]", "1_0",
    "5", '{ type = "sphere" }', '"sphere"', "2.5", "100", "0.001", "1e3",
]  # fmt: skip


def changed_case(text: str, rng: random.Random) -> str:
    """Return a case with values scaled or exchanged, lines lost, doubled or moved, keys renamed, bytes damaged, or a
    list in the place of a table.

    Bytes that are no text become surrogates, to be written as they were.
    """
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        lines = text.split("\n")
        at, kind = rng.randrange(len(lines)), rng.randrange(9)
        values = list(_VALUE.finditer(text))
        if kind < 3 and values:
            value = rng.choice(values)
            new = rng.choice(_ODD)
            if kind < 2 and re.fullmatch(r"-?[\d.]+", value[0]):
                new = f"{float(value[0]) * rng.choice((0.5, 0.9, 1.1, 2, 10, -1, 1e3, 1e-3)):.6g}"
            text = text[: value.start()] + new + text[value.end() :]
        elif kind == 3:
            text = "\n".join(lines[:at] + lines[at + 1 :])
        elif kind == 4:
            text = "\n".join([*lines[:at], lines[at], *lines[at:]])
        elif kind == 5:
            text = "\n".join([*lines[:at], lines[rng.randrange(len(lines))], *lines[at:]])
        elif kind == 6 and " = " in lines[at]:
            unit = rng.choice(("_mm", "_deg", "_rpm", "_GPa", "s", "_", " "))
            text = "\n".join([*lines[:at], lines[at].replace(" = ", f"{unit} = ", 1), *lines[at + 1 :]])
        elif kind == 7:
            data = damaged(text.encode(errors="surrogateescape"), rng)
            text = data.decode(errors="surrogateescape") or "\n"
        elif kind == 8:
            headers = list(re.finditer(r"(?m)^\[\[?(\w+)\]?\](?= *$)", text))
            if headers:
                header = rng.choice(headers)
                other = f"[{header[1]}]" if header[0].startswith("[[") else f"[[{header[1]}]]"
                text = text[: header.start()] + other + text[header.end() :]
    return text


def changed_summary(text: str, rng: random.Random) -> str:
    """Return JSON with one value of another kind, or one key lost or renamed."""
    whole = json.loads(text)
    places: list[tuple[Any, Any]] = []
    todo = [whole]
    while todo:
        inner = todo.pop()
        keys = list(inner) if isinstance(inner, dict) else range(len(inner))
        places += [(inner, key) for key in keys]
        todo += [inner[key] for key in keys if isinstance(inner[key], dict | list)]
    inner, key = rng.choice(places)
    kind = rng.randrange(4)
    if kind < 2 or not isinstance(inner, dict):
        inner[key] = rng.choice((None, "", "a/../b", [], {}, -1, 1e300, float("nan"), True, [None], {"a": 1}))
    else:
        value = inner.pop(key)
        if kind == 2:
            inner[rng.choice(("", "../up", "\x1b[2J", "<b>", 300 * "a"))] = value
    return json.dumps(whole)
