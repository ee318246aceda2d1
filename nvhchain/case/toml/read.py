"""TOML files as tables; what cannot be read is refused in one line."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nvhchain.errors import InputError, require
from nvhchain.names import check_text

_LARGEST = 2**26
"""Bytes of a file; a device without end has more."""


def read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """Return the table of a TOML file, and its text.

    Raises InputError if the file cannot be read, is too large, or is not valid TOML.
    """
    folder = os.path.isdir(path)  # also answers for names that are too long
    inside = sorted(path.glob("*.toml")) if folder else []
    require(
        not folder,
        f"{path} is a folder: name a file in TOML{f', such as {inside[0]}' if inside else ''}",
    )
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
        require(len(content) <= _LARGEST, f"{path}: more than {_LARGEST >> 20} MB: give a file in TOML")
        text = content.decode("utf-8-sig").replace("\r\n", "\n")
        return tomllib.loads(text), text
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start + 1} is none of UTF-8 text: save the file as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(_syntax(str(error), path)) from None
    except RecursionError:
        raise InputError(f"{path}: {TOO_DEEP}") from None
    except InputError:
        raise
    except ValueError:
        raise InputError(f"{path}: {TOO_LONG}") from None


TOO_DEEP = "tables or lists are nested in hundreds of others: a case needs less than ten levels"
"""Refusal of tables that no reader can follow."""

TOO_LONG = "a whole number lies beyond 64 bits: write it as a decimal, such as 1e20"
"""Refusal of whole numbers beyond those of TOML (64 bits)."""


def check_texts(value: Any, place: str) -> None:
    """Refuse (InputError) control characters in any text or key, and whole numbers beyond 64 bits."""
    require(not isinstance(value, int) or -(2**63) <= value < 2**63, f"{place}: {TOO_LONG}")
    if isinstance(value, Mapping):
        for key, inner in value.items():
            check_text(key, f"{place}: key")
            check_texts(inner, f"{place}.{key}")
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            check_texts(inner, f"{place}[{number}]")
    elif isinstance(value, str):
        check_text(value, place)


def _syntax(message: str, path: Path) -> str:
    """Return the message of invalid TOML, with its line in front."""
    found = re.search(r" \(at line (\d+), (column \d+)\)$", message)
    if found is None:
        return f"{path}: not valid TOML: {message}"
    return f"{path}:{found[1]}: not valid TOML: {message[: found.start()]} ({found[2]})"
