"""Checkpoints: finished bands of frequencies on disk, one file each, from which an interrupted run resumes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.acoustics.systems.frequency_blocks import Solved
from nvhchain.files import hdf5
from nvhchain.files.result_cache import cached_result, code_version, fingerprint
from nvhchain.handoff import FloatArray, SolvedBand


@dataclass(frozen=True)
class BandCheckpoints:
    """Checkpoints of the bands of one step.

    folder : folder of the files.
    step : name of the step.
    inputs : all inputs of the values besides the frequencies of the band.

    A file is used only if its checksum is correct and its inputs, frequencies and code are those of this run.
    """

    folder: Path
    step: str
    inputs: tuple[Any, ...]

    def find(self, frequency: FloatArray) -> Solved | None:
        """Return the band of these frequencies; None if it has no checkpoint."""
        path, key = self._place(frequency)
        band = cached_result(path, SolvedBand, key)
        if band is None:
            return None
        values = band.values.reshape(len(band.frequency), *band.shape)
        return Solved(values, band.record)

    def keep(self, frequency: FloatArray, solved: Solved) -> None:
        """Save a band, whole or not at all; WriteError for a full disk or a folder in its place."""
        path, key = self._place(frequency)
        provenance = {"stage": f"acoustics.{self.step}", "key": key}
        shape = solved.values.shape[1:]
        rows = solved.values.reshape(len(frequency), -1)
        hdf5.save(SolvedBand(frequency, rows, np.array(shape), solved.record, provenance=provenance), path)

    def _place(self, frequency: FloatArray) -> tuple[Path, str]:
        """Return (file, key) of the band of these frequencies."""
        key = fingerprint("checkpoint", code_version("acoustics"), self.step, self.inputs, frequency)
        return self.folder / f"{self.step}-{key[:16]}.h5", key


def checkpoints_in_folder(folder: str | Path | None, step: str, *inputs: Any) -> BandCheckpoints | None:
    """Return the checkpoints of a step with these inputs; None without a folder.

    The folder is created and a file is tried in it. InputError before the solution if either fails.
    """
    if not folder:
        return None
    return BandCheckpoints(hdf5.writable_folder(folder, "checkpoints"), step, inputs)
