"""Where measured tables go."""

from __future__ import annotations

from pathlib import Path

MEASURED = Path(__file__).parents[1] / "docs" / "measured"


def publish(name: str, text: str) -> None:
    """Print `text` (Markdown) and keep it as docs/measured/NAME.md, which the documentation includes."""
    MEASURED.mkdir(exist_ok=True)
    (MEASURED / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)
