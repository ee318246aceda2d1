"""Foreign files: hand-offs in and out of other programs' formats."""

from nvhchain.interop.wav import write_wav

__all__ = ["write_wav"]
