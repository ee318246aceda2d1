"""Make fused_golden.npz anew: bempp-cl's matrices of a notched box at quadrature orders far past convergence.

Run by hand (minutes: bempp-cl compiles in every process): python -m tests.acoustics.regenerate_fused_golden
"""

from pathlib import Path

import numpy as np

from nvhchain.acoustics.systems import _bempp
from nvhchain.fidelity import AcousticsFidelity
from nvhchain.testing.bodies import notched_box

WAVENUMBERS = (3.0, 20.0)  # rad/m, edges of 0.1 m: 21 and 3 elements per wavelength


def main() -> None:
    fidelity = AcousticsFidelity(elements_per_wavelength=3.0, masters=2, quadrature_order=20, singular_order=12)
    systems = list(_bempp.systems(notched_box(), WAVENUMBERS, fidelity))
    np.savez_compressed(
        Path(__file__).with_name("fused_golden.npz"),
        wavenumber=np.array(WAVENUMBERS),
        a=np.array([a for a, _ in systems]),
        b=np.array([b for _, b in systems]),
    )


if __name__ == "__main__":
    main()
