"""What the command line shows while it works."""

from __future__ import annotations

import sys
import time
from typing import Any

from nvhchain.cli.output import show
from nvhchain.names import printable


class Console:
    """Progress on stderr: bars with remaining time on a terminal, one line per finished stage elsewhere."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._started = 0.0

    def begin(self, stage: str) -> None:
        self._started = time.perf_counter()
        if sys.stderr.isatty():
            from tqdm import tqdm

            self._bar = tqdm(
                desc=printable(stage), total=1, leave=False, bar_format="{desc}: {percentage:3.0f}% |{bar}| {remaining}"
            )

    def step(self, stage: str, done: int, total: int) -> None:
        if self._bar is not None:
            self._bar.total, self._bar.n = total, done
            self._bar.refresh()

    def end(self, stage: str, how: str) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        seconds = f" in {time.perf_counter() - self._started:.1f} s" if how == "computed" else ""
        show(f"{stage}: {how}{seconds}", error=True)
