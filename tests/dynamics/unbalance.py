"""Forces on each rigid shaft of a gearbox in balance, added up apart from the search for the balance."""

from dataclasses import replace

import numpy as np

from nvhchain.bearings import StiffnessMatrix
from nvhchain.dynamics.model.assembly import assemble
from nvhchain.dynamics.model.train import shaft_torques
from nvhchain.dynamics.time_loop.equilibrium import LEAST_LOAD

SPRING = StiffnessMatrix(tuple(map(tuple, (1e8 * np.eye(5)).tolist())))


def unbalance(found, laws, torque):
    """Largest sum of forces or of moments on a shaft, relative to the largest of them."""
    gearbox = found.gearbox
    bearings, links = (
        tuple(replace(each, model=SPRING, radial_stiffness=1.63e8, axial_stiffness=5.05e7) for each in part)
        for part in (gearbox.bearings, gearbox.shaft_bearings)
    )
    gearbox = replace(gearbox, bearings=bearings, shaft_bearings=links)
    assembly = assemble(gearbox, laws, None)
    carried = np.array([s * found.mesh_force[mesh] for mesh, s in zip(assembly.mesh, assembly.share, strict=True)])
    flank = assembly.contact[2 * np.arange(len(carried)) + (carried < 0)]
    outside = assembly.load(shaft_torques(gearbox, assembly.train, torque)) - flank.T @ np.abs(carried)
    motions = np.vstack([assembly.bearing_map, assembly.link_map])
    held = motions.T * np.concatenate([found.bearing_load.ravel(), found.shaft_bearing_load.ravel()])
    worst = 0.0
    for first in range(0, 5 * len(gearbox.shafts), 5):
        for part in (slice(first, first + 3), slice(first + 3, first + 5)):
            largest = max(np.abs(outside[part]).max(), np.abs(held[part]).max(), LEAST_LOAD)
            worst = max(worst, np.abs(held[part].sum(axis=1) - outside[part]).max() / largest)
    return worst
