"""Compiled: velocities delayed by the way of their sound."""

import numba as nb
import numpy as np

_COMPLEX_2 = nb.types.Array(nb.complex128, 2, "C", readonly=True)
_REAL_1 = nb.types.Array(nb.float64, 1, "C", readonly=True)


@nb.njit(nb.complex128[:, ::1](_REAL_1, _REAL_1, _COMPLEX_2), cache=True, nogil=True)
def delayed(wavenumber, distance, velocity):  # type: ignore[no-untyped-def]
    """Return v e^{−jkr} for every line and face.

    Equally spaced lines, like those of a Fourier transform, advance the phase by a multiplication. Their spacing may
    differ by rounding only. After a piece of lines, the phase is therefore still correct to about 1e-12 rad.
    """
    lines, faces = velocity.shape
    delayed = np.empty((lines, faces), dtype=np.complex128)
    phase = np.empty(faces, dtype=np.complex128)
    advance = np.empty(faces, dtype=np.complex128)
    spacing = np.inf
    for line in range(lines):
        k = wavenumber[line]
        step = k - wavenumber[line - 1] if line > 0 else np.inf
        if abs(step - spacing) <= 4e-16 * k:
            for f in range(faces):
                phase[f] *= advance[f]
        else:
            spacing = wavenumber[line + 1] - k if line + 1 < lines else np.inf
            for f in range(faces):
                phase[f] = complex(np.cos(k * distance[f]), -np.sin(k * distance[f]))
            if spacing < np.inf:
                for f in range(faces):
                    advance[f] = complex(np.cos(spacing * distance[f]), -np.sin(spacing * distance[f]))
        for f in range(faces):
            delayed[line, f] = velocity[line, f] * phase[f]
    return delayed
