"""Result of a run in notebooks: its text, its table and its figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from html import escape
from typing import TYPE_CHECKING

from nvhchain.errors import InputError
from nvhchain.handoff import HandOff

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nvhchain.chain.result import Result


class ResultPlots:
    """Figures of a result, `result.plot`; each returns its axes.

    result: result to draw.
    """

    def __init__(self, result: Result) -> None:
        self._result = result

    def spectrum(self, *, point: int = 0, axes: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw the level of the sound pressure over frequency, with confidence limits.

        axes: two axes; those of a new figure by default.
        """
        from nvhchain import plots
        from nvhchain.error_band import ErrorBand

        result = self._result
        if result.pressure is None:
            raise InputError(
                f"{result.case.name} has no spectrum of sound pressure: ask for `pressure` at constant speed"
            )
        band, name = result.error_band, result.case.name
        bands = {name: band} if isinstance(band, ErrorBand) else None
        return plots.pressure_spectrum({name: result.pressure}, point=point, bands=bands, axes=axes)


def summary(result: Result) -> str:
    """Return one line: case, fidelity, levels and hand-offs."""
    parts = [f"{result.case.name}, {result.fidelity.name}"]
    if result.pressure is not None or result.pressure_history is not None:
        points = result.case.field_points
        levels = (f"{level:.1f} dB(A) at {point.name}" for point, level in zip(points, result.overall, strict=True))
        parts.append(", ".join(levels))
    parts.append(", ".join(hand_offs(result)))
    return f"Result({': '.join(parts[:2])}; {parts[-1]})" if len(parts) > 2 else f"Result({'; '.join(parts)})"


def hand_offs(result: Result) -> dict[str, HandOff]:
    """Return the hand-offs of a result by field; those of several stages are numbered."""
    found: dict[str, HandOff] = {}
    for field in fields(result):
        value = getattr(result, field.name)
        if isinstance(value, HandOff):
            found[field.name] = value
        elif isinstance(value, tuple):
            found |= {f"{field.name}[{n}]": item for n, item in enumerate(value) if isinstance(item, HandOff)}
    return found


def html(result: Result) -> str:
    """Return the summary and a table of the hand-offs."""
    rows = "".join(
        f"<tr><td>{name}</td><td>{escape(repr(hand_off))}</td></tr>" for name, hand_off in hand_offs(result).items()
    )
    return f"<b>{escape(summary(result))}</b><table>{rows}</table>"
