"""Arrays of a MED file as npz on stdout; run as a process by its path, so that only NumPy and h5py are loaded."""

from __future__ import annotations

import json
import sys
from typing import Any

_MEMORY = 8 << 30
"""Limit of the address space (bytes)."""

_LARGEST_RATIO = 20
"""Largest number of values in an array per byte of the file; a file may announce any number."""


def _limit_memory() -> None:
    try:
        import resource
    except ImportError:  # not on Windows
        return
    for kind, most in ((resource.RLIMIT_AS, _MEMORY), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(kind)[1]
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (limit, limit))


def _array(data: Any, kinds: str) -> Any:
    import h5py

    if not isinstance(data, h5py.Dataset) or data.dtype.base.kind not in kinds:
        raise ValueError(f"{getattr(data, 'name', 'an array')} is not an array of numbers")
    if data.size > _LARGEST_RATIO * data.file.id.get_filesize():
        raise ValueError(f"{data.name} announces {data.size} numbers")
    return data[()]


def _only(group: Any, subject: str) -> Any:
    names = list(group)
    if len(names) != 1:
        raise ValueError(f"it holds {len(names)} {subject}, one is needed")
    return group[names[0]]


def _groups(families: Any) -> dict[str, list[str]]:
    """Return the names of groups by number of the family."""
    found = {}
    for family in (families or {}).values():
        if "GRO" in family:
            rows = _array(family["GRO/NOM"], "iu").reshape(-1, 80)
            found[str(int(family.attrs["NUM"]))] = [
                bytes(row.astype("u1")).split(b"\0")[0].decode("utf-8", "replace").strip() for row in rows
            ]
    return found


def _serve(path: str) -> None:
    import io

    import h5py
    import numpy as np

    with h5py.File(path, "r") as file:
        whole = _only(file["ENS_MAA"], "meshes")
        name = whole.name.rsplit("/", 1)[1]
        step = _only({key: whole[key] for key in whole if isinstance(whole[key], h5py.Group)}, "steps")
        arrays: dict[str, Any] = {"points": _array(step["NOE/COO"], "f")}
        if "NOE/FAM" in step:
            arrays["family"] = _array(step["NOE/FAM"], "iu")
        for kind, cells in step["MAI"].items():
            arrays[f"nodes {kind}"] = _array(cells["NOD"], "iu")
            if "FAM" in cells:
                arrays[f"family {kind}"] = _array(cells["FAM"], "iu")
        families = file.get(f"FAS/{name}", {})
        names = {"points": _groups(families.get("NOEUD")), "cells": _groups(families.get("ELEME"))}
    content = io.BytesIO()
    np.savez(content, names=np.array(json.dumps(names)), **arrays)
    sys.stdout.buffer.write(content.getbuffer())


if __name__ == "__main__":
    _limit_memory()
    try:
        _serve(sys.argv[1])
    except Exception as error:
        print(" ".join(str(error).split()) or type(error).__name__, file=sys.stderr)
        sys.exit(1)
