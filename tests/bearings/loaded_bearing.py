"""Displacement of a single bearing under a load, by the search that the equilibrium of a gearbox takes."""

import numpy as np

from nvhchain.bearings.loaded import load_surplus, usual_stiffness
from nvhchain.bearings.newton import settle


def displacement(bearing, load, *, tilts=True):
    """Motions (5,), m and rad, under a load (5,), N and N m; `tilts=False` holds the tilts at 0."""
    free = np.arange(5 if tilts else 3)
    spring, reach = usual_stiffness(bearing)
    # a motion that the bearing leaves free is held
    scale = np.diag(spring)
    spring = spring + np.diag(np.where(scale <= 1e-9 * scale.max(), 1e-3 * scale.max(), 0.0))
    lever = np.sqrt(np.diag(spring)[3:].max() / np.diag(spring)[:3].max())
    sizes = (np.linalg.norm(load[:3]) + np.linalg.norm(load[3:]) / lever) * np.array([1.0, 1.0, 1.0, lever, lever])

    def padded(x):
        return np.append(x, np.zeros(5 - len(free)))

    def forces(x):
        force, stiffness = bearing.evaluate(padded(x))
        return force[free], stiffness[np.ix_(free, free)]

    held = spring[np.ix_(free, free)]
    surplus = load_surplus(np.linalg.solve(held, load[free]), reach)
    return padded(settle(forces, load[free], held, sizes[free], 1e-10, surplus).position)
