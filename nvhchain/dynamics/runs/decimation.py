"""Decimation: outputs at a lower sampling rate from states and contact forces of the time loop, without aliasing.

A symmetric low-pass of 2 H + 1 taps is applied to the outputs at every step, without forming them. The state at the
start of the filter's window and the excess forces inside it determine all outputs. With y = Re(c z) and z ← D z + gain
− drive r,

    Σ_k h_k y_{m+k} = Re(Σ_k h_k c D^k) z_m − Σ_j Σ_{k>j} h_k Re(c D^{k−1−j} drive) r_{m+j} + constant,

one matrix product per block of samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from nvhchain.dynamics.time_loop.simulation import Simulation
from nvhchain.errors import require
from nvhchain.fidelity import DynamicsFidelity
from nvhchain.handoff import FloatArray


@dataclass(frozen=True, eq=False)
class Decimator:
    """Filter that forms the outputs at a lower sampling rate.

    The outputs are bearing forces (3 n_bearing) (N), then deflections of the drive flanks and of the back flanks
    (n_mesh each, m). The transmission errors of the meshes (n_mesh, m) follow. The last is the angle (rad) by which the
    output lags behind the input.

    stride : steps per sample.
    half : H, steps on either side of a sample that its filter covers, a multiple of stride.
    state_factor : (n_state, n_out) factor of the state.
    excess_factor : ((2 H + 2) (2 n_row + n_push), n_out) factor of the excess forces.
    constant : (n_out,) constant part.

    The output around step m + H is state_m · state_factor + (excesses m − 1 … m + 2 H) · excess_factor + constant.
    """

    stride: int
    half: int
    state_factor: FloatArray
    excess_factor: FloatArray
    constant: FloatArray

    def apply(self, states: FloatArray, excesses: FloatArray) -> FloatArray:
        """Return samples (n, n_out) from states (n, n_state) at every stride-th step and excesses.

        The excesses include those before the first state and 2 H after the last.
        """
        width = 2 * self.half + 2
        windows = sliding_window_view(excesses, width, axis=0)[:: self.stride][: len(states)].transpose(0, 2, 1)
        seen = windows.reshape(len(states), len(self.excess_factor))
        return np.asarray(states @ self.state_factor + seen @ self.excess_factor + self.constant, dtype=float)


def low_pass(rate: float, stride: int, f_max: float, attenuation: float) -> FloatArray:
    """Return the filter taps (2 H + 1) for keeping every `stride`-th sample of a record at `rate` (Hz).

    The filter passes up to f_max and stops the frequencies that would alias below f_max. Kaiser window, attenuation in
    dB. Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, section 7.5.3.
    """
    if stride == 1:
        return np.ones(1)
    half, beta = _window(rate, stride, f_max, attenuation)
    from scipy.signal import firwin  # slow to import

    return np.asarray(firwin(2 * half + 1, 0.5 * rate / stride, window=("kaiser", beta), fs=rate))


def low_pass_reach(rate: float, stride: int, f_max: float, attenuation: float) -> int:
    """Return H, the steps on either side of a sample that `low_pass` covers."""
    return 0 if stride == 1 else _window(rate, stride, f_max, attenuation)[0]


def _window(rate: float, stride: int, f_max: float, attenuation: float) -> tuple[int, float]:
    """Return H, a multiple of `stride`, and the shape parameter β of the Kaiser window."""
    kept = rate / stride
    require(
        kept > 2.0 * f_max,
        f"a record at {kept:g} Hz does not cover f_max = {f_max:g} Hz: store more than {2 * f_max:g} samples a second",
    )
    from scipy.signal import kaiserord  # slow to import

    count, beta = kaiserord(attenuation, (kept - 2.0 * f_max) / (0.5 * rate))
    return -(-(count // 2) // stride) * stride, beta


def record_stride(time_step: float, f_max: float, fidelity: DynamicsFidelity) -> int:
    """Return the steps per stored sample that leave `stored_samples_per_period` samples in a period of f_max."""
    return max(1, int(1.0 / (time_step * f_max * fidelity.stored_samples_per_period) * (1.0 + 1e-9)))


def decimator(model: Simulation, stride: int, taps: FloatArray) -> Decimator:
    """Return the filter of `model` for every `stride`-th step through `taps` (2 H + 1)."""
    n_z, drive = len(model.step.decay), np.concatenate([model.step.drive, model.step.push])
    n_c = len(drive)
    outputs = np.vstack([model.bearing_output, model.deflection_output, model.back_output, model.error_output])
    rows = outputs[:, :n_z] - 1j * outputs[:, n_z:]  # y = Re(rows z)
    jump = np.zeros((len(outputs), n_c))
    jump[: len(model.bearing_jump), : len(model.contact_stiffness)] = model.bearing_jump
    count, n_out = len(taps), len(outputs)
    constant = np.zeros(n_out)
    # excess_factor[j] multiplies the force of step m − 1 + j
    excess_factor = np.zeros((count + 1, n_c, n_out))
    excess_factor[1:] -= taps[:, None, None] * jump.T
    excess_factor[:-1] += taps[:, None, None] * jump.T
    # Σ_{k>j} h_k c D^{k−1−j} from its value for j + 1, down to j = −1, the factor of the state
    remaining = np.zeros_like(rows)
    for j in range(count - 1, -1, -1):
        excess_factor[j + 1] -= (remaining @ drive.T).real.T
        constant += (remaining @ model.step.gain).real
        remaining = taps[j] * rows + remaining * model.step.decay
    return Decimator(
        stride,
        count // 2,
        np.ascontiguousarray(np.hstack([remaining.real, -remaining.imag]).T),
        excess_factor.reshape(-1, n_out),
        constant,
    )
