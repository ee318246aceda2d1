"""Free memory for this process: of the machine, or of its container."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import psutil

_FILES = {
    "": ("memory.max", "memory.current", "inactive_file"),
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
}
"""Files of the limit and of the use, and the reclaimable part of the use in memory.stat, by controller: version 2 and
1."""


def free_memory(root: Path = Path("/")) -> int:
    """Return the free memory (bytes): of the machine, or below the limits of its control groups if that is less.

    root : folder of proc and sys/fs/cgroup.

    Control groups (Linux) are those of this process; containers and batch systems set them.
    """
    return max(0, min([int(psutil.virtual_memory().available), *_control_group_memory(root)]))


def _control_group_memory(root: Path) -> Iterator[int]:
    """Yield the free memory of every control group with a limit; nothing if there are no control groups."""
    try:
        lines = (root / "proc/self/cgroup").read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, place = line.split(":", 2)
        controller = next((name for name in controllers.split(",") if name in _FILES), None)
        if controller is None:
            continue
        limit, use, reclaimed = _FILES[controller]
        base = root / "sys/fs/cgroup" / controller
        # in a container the path may be that of the host, of which only the base is visible
        below = Path(place.lstrip("/"))
        for folder in (base / below, *(base / parent for parent in below.parents)):
            try:
                most, used = int((folder / limit).read_text()), int((folder / use).read_text())
                stat = dict(entry.split() for entry in (folder / "memory.stat").read_text().splitlines())
            except (OSError, ValueError):  # no such file, or "max": no limit
                continue
            yield most - used + int(stat.get(reclaimed, 0))
