"""List docstrings of public names that numpydoc's validation refuses, as `file:line: name: code message`.

Checks stand in `[tool.numpydoc_validation]` of pyproject.toml. numpydoc's own hook reads files with
their private names, and takes a dataclass for a class without parameters.
"""

import importlib
import inspect
import sys
from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, is_typeddict

from numpydoc.docscrape import get_doc_object
from numpydoc.hooks.validate_docstrings import parse_config
from numpydoc.validate import Validator, validate

from nvhchain.handoff import HandOff

ROOT = Path(__file__).parents[1]


def public() -> Iterator[tuple[str, Any]]:
    """Yield every function and class in `__all__` of a package or module with a page in docs/api."""
    for path in sorted((ROOT / "docs" / "api").glob("*.rst")):
        module = importlib.import_module("nvhchain" if path.stem == "nvhchain" else f"nvhchain.{path.stem}")
        for value in (getattr(module, key) for key in module.__all__):
            if inspect.isclass(value) or inspect.isroutine(value):
                yield f"{value.__module__}.{value.__qualname__}", value


class Docstring(Validator):
    """Docstring of a public name, which need not repeat what the code or another docstring holds."""

    def __init__(self, obj_name: str, value: Any) -> None:
        super().__init__(get_doc_object(value))

    @property
    def signature_parameters(self) -> tuple[str, ...]:
        """Parameters to document: without those of a base that has its own docstring."""
        if not inspect.isclass(self.obj):
            return tuple(super().signature_parameters)
        own = vars(self.obj).get("__annotations__", {})
        if is_typeddict(self.obj):
            return tuple(own)
        if vars(self.obj).get("_is_protocol") or (is_dataclass(self.obj) and not own):
            return ()
        declared = {"provenance"} if issubclass(self.obj, HandOff) else set()
        bases = [base for base in self.obj.__mro__[1:] if is_dataclass(base)]
        declared |= {name for base in bases for name in vars(base).get("__annotations__", {})} - {
            *self.doc_all_parameters
        }
        return tuple(name for name in super().signature_parameters if name not in declared)

    def parameter_type(self, param: str) -> str:
        """Type of a parameter; those described "As in `another_function`." need not repeat it."""
        kind, description = self.doc_all_parameters[param]
        return "as there" if " ".join(description).startswith("As in `") else kind


def mistakes() -> Iterator[str]:
    """Yield one line for every mistake."""
    config = parse_config(ROOT)
    for name, value in public():
        result = validate(name, Docstring, value=value)
        for code, message in result["errors"]:
            if code in config["checks"]:
                path = Path(result["file"]).relative_to(ROOT)
                yield f"{path}:{result['file_line']}: {value.__name__}: {code} {message}"


if __name__ == "__main__":
    lines = sorted(mistakes())
    print("\n".join(lines) or "All docstrings of public names are valid")
    sys.exit(bool(lines))
