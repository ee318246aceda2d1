"""Bodies that move in three dimensions: compact shapes for page.js, coloured by their motion or by given values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nvhchain.handoff import ComplexArray, FloatArray, Surface
from nvhchain.report.page.blocks import Figure, packed

TRUNCATION = 2e-3
"""Largest error of the motion at a line, relative to its root sum of squares over the faces."""

VALUES = 900_000
"""Largest number of values of all shapes on one surface; it bounds the size of the page."""

VIEWS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (0.75, -0.6) for z in (1.25, -1.25)])
"""Places of the viewer, in units of the body; y is upwards."""


@dataclass(frozen=True)
class Colours:
    """Colours of the faces by kind.

    `level`: dB of the motion re `reference` (RMS); `size`: motion relative to the largest; `signed` and `given`: values
    of the body with this title, the latter levels in dB, all zero at a line without values.
    """

    title: str
    unit: str
    kind: str
    reference: float = 1.0


@dataclass(frozen=True, eq=False)
class MovingBody:
    """Body with its motion at every line or mode.

    motion : (n_line, n_face) outward normal motion of the faces, or (n_line, n_vertex, 3) of the vertices.
    values : title of `signed` or `given` colours → values of the faces (n_line, n_face).
    """

    name: str
    surface: Surface
    motion: ComplexArray
    values: Mapping[str, FloatArray] = field(default_factory=dict)


def moving_bodies(
    bodies: Sequence[MovingBody],
    lines: Sequence[str],
    colours: Sequence[Colours],
    caption: str,
    *,
    chosen: int = 0,
    what: str = "line",
) -> Figure:
    """Return a figure with bodies side by side, which turn together and move in phase.

    Motions on one surface share orthogonal shapes of 16 bits; `TRUNCATION` bounds the error at every line.
    """
    surfaces = list({body.surface.content_hash: body.surface for body in bodies}.values())
    runs: list[dict[str, Any]] = []
    packs = []
    for number, surface in enumerate(surfaces):
        here = [body for body in bodies if body.surface.content_hash == surface.content_hash]
        shapes, coordinates = _compressed([body.motion.reshape(len(lines), -1) for body in here])
        packs.append(_body(surface) | {"shapes": _quantised(shapes, "i2")})
        for body, body_coordinates in zip(here, coordinates, strict=True):
            runs.append(
                {
                    "title": body.name,
                    "surface": number,
                    "real": packed(body_coordinates.real),
                    "imag": packed(body_coordinates.imag),
                    "values": {title: _quantised(values, "i1") for title, values in body.values.items()},
                }
            )
    runs.sort(key=lambda run: [body.name for body in bodies].index(run["title"]))
    data = {
        "surfaces": packs,
        "runs": runs,
        "lines": list(lines),
        "what": what,
        "chosen": chosen,
        "eye": _eye(bodies, chosen),
        "colours": [vars(scheme) for scheme in colours],
    }
    return Figure(caption, data, height=400, kind="motion")


def _compressed(motions: Sequence[ComplexArray]) -> tuple[FloatArray, list[ComplexArray]]:
    """Return orthogonal shapes (n_shape, n_face) and, per motion, its coordinates (n_line, n_shape)."""
    rows = np.concatenate([part for motion in motions for part in (motion.real, motion.imag)])
    size = np.linalg.norm(rows, axis=1)
    scaled = rows / np.where(size > 0, size, 1.0)[:, None]
    squares, left = np.linalg.eigh(scaled @ scaled.T)  # singular values and vectors of few long rows
    sizes, left = np.sqrt(np.maximum(squares[::-1], 0.0)), left[:, ::-1]
    most = max(1, min(VALUES // rows.shape[1], rows.shape[1]))
    count = int(np.clip(np.count_nonzero(sizes > TRUNCATION), 1, most))
    used = np.where(sizes[:count] > 0, sizes[:count], 1.0)
    shapes = (left[:, :count] / used).T @ scaled
    coordinates = size[:, None] * left[:, :count] * sizes[:count]
    parts = np.split(coordinates, 2 * len(motions)) if motions else []
    return shapes, [real + 1j * imag for real, imag in zip(parts[::2], parts[1::2], strict=True)]


def _quantised(values: FloatArray, kind: str) -> dict[str, Any]:
    """Return rows as integers, with the value of one step of each row."""
    top = float(np.iinfo(kind).max)
    step = np.abs(values).max(axis=1, initial=0.0) / top
    whole = np.rint(values / np.where(step > 0, step, 1.0)[:, None])
    return {"values": packed(whole.ravel(), kind), "step": packed(step)}


def _body(surface: Surface) -> dict[str, Any]:
    return {"vertices": packed(surface.vertices.ravel()), "triangles": packed(surface.triangles.ravel(), "i4")}


def _eye(bodies: Sequence[MovingBody], line: int) -> dict[str, float]:
    """Return the place of the viewer, obliquely in front of the side that moves most at a line."""
    seen = np.zeros(len(VIEWS))
    for body in bodies:
        if body.motion.ndim > 2:
            continue
        power = np.abs(body.motion[line]) ** 2 * body.surface.areas
        seen += np.maximum(body.surface.normals @ VIEWS.T, 0.0).T @ power
    return dict(zip("xyz", VIEWS[seen.argmax()].tolist(), strict=True))
