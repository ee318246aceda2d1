"""nvhchain: from gear geometry to sound pressure."""

from nvhchain.fidelity import DRAFT, REFERENCE, STANDARD

__version__ = "0.1.0"
__all__ = ["DRAFT", "REFERENCE", "STANDARD"]
