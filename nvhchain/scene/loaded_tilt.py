"""Static tilt of gears that their shafts, bearings and teeth hold together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos

import numpy as np

from nvhchain.errors import SolverError
from nvhchain.gear import GearPair, Misalignment
from nvhchain.handoff import FloatArray, MeshPeriod

SMALLEST_TILT = 1e-7
"""Tilt (rad) to which the balance is solved: 2 nm at the ends of a face of 40 mm."""

ROUNDS = 20
"""Largest number of Newton iterations; two to four are usual."""

ANGLES, SLICES = 8, 8
"""Angles of the mesh period over which the moment of the load is averaged, and slices of the face.

On the thesis's slotted gears with flexible shafts (−1260 and 122 µrad) 16 angles and 32 slices change it by 1 µrad.
"""


def tilted(pair: GearPair, tilt: Sequence[float]) -> GearPair:
    """Return a pair with a tilt (2,) (rad) beside its own misalignment."""
    own = pair.misalignment
    return replace(pair, misalignment=Misalignment(own.in_plane + float(tilt[0]), own.normal + float(tilt[1])))


def balanced_tilts(
    pairs: Sequence[GearPair],
    forces: Sequence[float],
    tilts: Callable[[FloatArray], FloatArray],
    loaded: Callable[[int, GearPair], MeshPeriod],
) -> FloatArray:
    """Return the tilts (n_mesh, 2) (rad) of wheels against pinions, in balance with the load on the flanks.

    forces: static force of every mesh (N).
    tilts: function of the moments (n_mesh,) (N m) by which the teeth oppose the tilt, as `opposed_misalignment`.
    loaded: function of the number of a mesh and its tilted pair, which returns its period under the force.

    Notes
    -----
    A tilt ψ in the plane of action moves the centre of the load by ζ(ψ), mean over the mesh period. The load then
    opposes the tilt with M = F cos β_b ζ. Both grow with the tilt, shafts give way by less the larger M is: Newton's
    method finds the one balance. On back flanks, and on meshes without load, M is 0.
    """
    drive = [number for number, force in enumerate(forces) if force > 0.0]
    moment = np.zeros(len(pairs))
    found = tilts(moment)
    if not drive:
        return found

    def carried(tilt: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return moment (n_drive,) (N m) and its growth with the tilt (N m/rad)."""
        load_moment, growth = np.zeros(len(drive)), np.zeros(len(drive))
        for place, number in enumerate(drive):
            pair = pairs[number]
            period = loaded(number, tilted(pair, tilt[number]))
            lean, distribution = cos(pair.base_helix_angle), period.distribution
            load_moment[place] = forces[number] * lean * float(distribution.offset.mean())
            growth[place] = distribution.tilt_ratio * period.stiffness * (lean * pair.face_width) ** 2 / 12.0
        return load_moment, growth

    give = np.zeros((len(drive), len(drive)))
    for place, number in enumerate(drive):
        probe = np.zeros(len(pairs))
        probe[number] = forces[number] * pairs[number].face_width / 12.0
        give[:, place] = (found - tilts(probe))[drive, 0] / probe[number]
    wanted, growth = carried(found)
    for _ in range(ROUNDS):
        gap = wanted - moment[drive]
        if np.abs(give @ gap).max() <= SMALLEST_TILT:
            return found
        step, reach = np.linalg.solve(np.eye(len(drive)) + growth[:, None] * give, gap), 1.0
        while True:
            trial = moment.copy()
            trial[drive] += reach * step
            trial_tilt = tilts(trial)
            wanted, growth = carried(trial_tilt)
            if np.linalg.norm(wanted - trial[drive]) < np.linalg.norm(gap) or reach < 0.1:
                break
            reach *= 0.5
        moment, found = trial, trial_tilt
    raise SolverError("the tilt of the gears under load did not settle: leave loaded_misalignment off")
