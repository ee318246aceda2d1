"""OP4 matrices of Nastran, ASCII or binary; pyYeti reads them."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from nvhchain.errors import FileFormatError
from nvhchain.interop.matrices.labelled import LabelledMatrix, check_size
from nvhchain.runtime.extras import check_installed


def read_op4(path: Path) -> dict[str, LabelledMatrix]:
    """Return all matrices of a file by name, whose unknowns it does not state.

    Raises FileFormatError for a damaged file, InputError without the extra `nastran`.
    """
    check_installed("pyyeti")
    from pyyeti.nastran import op4

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            names, sizes = op4.dir(str(path), verbose=False)[:2]
            for name, size in zip(names, sizes, strict=True):
                check_size(str(path), name.upper(), max(size))
            found = op4.read(str(path))
    except FileFormatError:
        raise
    except Exception as error:  # the reader raises what it meets in a damaged file
        if type(error).__module__.startswith("nvhchain"):
            raise
        raise FileFormatError(f"{path}: damaged or truncated OP4: {type(error).__name__} {error}") from None
    return {
        name.upper(): LabelledMatrix(name.upper(), None, None, np.asarray(values)) for name, values in found.items()
    }
