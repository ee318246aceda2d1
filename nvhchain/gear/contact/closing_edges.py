"""Search range for tip edges beyond the path of contact that close under load.

The farther an edge is from the path, the farther it is from the mating flank.  Where edges at the limit
`GearFidelity.corner_gap` stay open, those beyond it stay open too.  Where one of them carries, the limit is raised to
the approach of the flanks.  An edge with a larger gap cannot close.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import sin, tan

import numpy as np
from numpy.typing import NDArray

from nvhchain.gear.compliance.analytic import SliceCompliance
from nvhchain.gear.compliance.flank_compliance import flank_compliance
from nvhchain.gear.contact.contact_lines import ContactLines, separation, wheel_angle
from nvhchain.gear.contact.engagement import Engagement, engaged_reach
from nvhchain.gear.drawing.pair import BACK, DRIVE

PLACES = 8
"""Number of places over the face width, each on another tooth of the body period, at which edges are put at the
limit."""

_PART = 0.05
"""Part of a slice that remains where the limit cuts it; its middle is then nearly at the limit."""


def close_edges(engagement: Engagement, drive: float, back: float = 0.0) -> Engagement:
    """Return an engagement whose `corner_gap` includes all edges that close at given approaches of the flanks.

    drive, back: approach of the drive and of the back flanks (m).
    Returns `engagement` itself, or one with a larger `corner_gap`.

    Compliances that reach over too few teeth are computed anew.  A `corner_gap` of 0 stays.
    """
    gap = engagement.fidelity.corner_gap
    closed, needed = False, gap
    for flank, approach in ((DRIVE, drive), (BACK, back)):
        if not 0 < gap < approach:
            continue
        for lines, at_limit in _edges_at_limit(engagement, flank):
            parted = separation(engagement.pair, lines)
            needed = max(needed, float((approach - parted + lines.corner).max(initial=0.0)))
            if not closed and (approach > parted[at_limit]).any():
                closed = bool(engagement.forces_on(lines, approach - parted[None])[0, at_limit].any())
    return _reaching(engagement, needed) if closed else engagement


def _edges_at_limit(engagement: Engagement, flank: int) -> Iterator[tuple[ContactLines, NDArray[np.bool_]]]:
    """Yield contact lines that end at the limit, before and after the path, and which of their slices (n,) do."""
    pair, fidelity = engagement.pair, engagement.fidelity
    before, after = pair.extensions(fidelity.corner_gap)
    tangent = pair.sense * tan(pair.base_helix_angle) * (1 if flank == DRIVE else -1)
    width = pair.face_width / engagement.slices
    for limit, inwards in ((pair.path[0] - before, 1.0), (pair.path[1] + after, -1.0)):
        for i in range(PLACES):
            # the inner end of a slice; the limit cuts its other end off
            bound = (i * engagement.slices // PLACES + (inwards * tangent > 0)) * width - pair.face_width / 2
            axial = bound - np.sign(inwards * tangent) * _PART * width
            mesh = i * pair.meshes_per_body_period // PLACES
            touch = limit + inwards * 1e-6 * (before + after)
            lines = engagement.lines(wheel_angle(pair, touch, float(axial), mesh, flank), flank)
            travel = 0.5 * lines.length * abs(sin(pair.base_helix_angle)) + 1e-5 * (before + after)
            yield lines, np.abs(lines.position - limit) <= travel


def _reaching(engagement: Engagement, gap: float) -> Engagement:
    """Return the engagement with the `corner_gap` `gap` (m) and compliances of sufficient reach."""
    pair, fidelity = engagement.pair, replace(engagement.fidelity, corner_gap=gap)
    reach = engaged_reach(pair, gap)
    pinion, wheel = (
        c
        if isinstance(c, SliceCompliance) or c.reach >= reach
        else flank_compliance(body, fidelity, reach=reach, friction=c.friction is not None)
        for c, body in zip(engagement.compliances, (pair.pinion, pair.wheel), strict=True)
    )
    return Engagement(pair, (pinion, wheel), fidelity, engagement.deviations)
