"""Finished bands of frequencies on disk, one whole file each, for a run that may be killed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nvhchain.acoustics.systems.frequency_blocks import Solved
from nvhchain.acoustics.systems.linear_system import SolverRecord
from nvhchain.files import hdf5
from nvhchain.files.shelf import code_version, fingerprint, found
from nvhchain.handoff import FloatArray, SolvedBand


@dataclass(frozen=True)
class BandShards:
    """Bands of one stage.

    stage: its name.  inputs: all that its values depend on beside the frequencies of the band.  A file is used only if
    it is whole by its checksum and if inputs, frequencies and code agree with those it was made with.
    """

    folder: Path
    stage: str
    inputs: tuple[Any, ...]

    def find(self, frequency: FloatArray) -> Solved | None:
        """The band of these frequencies, None if it has to be solved."""
        path, key = self._place(frequency)
        band = found(path, SolvedBand, key)
        if band is None:
            return None
        values = band.values.reshape(len(band.frequency), *band.shape)
        return Solved(values, SolverRecord.of(band.provenance))

    def keep(self, frequency: FloatArray, solved: Solved) -> None:
        """Save a band, whole or not at all.  Raises WriteError for a full disk or a folder in its place."""
        path, key = self._place(frequency)
        provenance = {"stage": f"acoustics.{self.stage}", "key": key, **solved.record.provenance}
        shape = solved.values.shape[1:]
        rows = solved.values.reshape(len(frequency), -1)
        hdf5.save(SolvedBand(frequency, rows, np.array(shape), provenance=provenance), path)

    def _place(self, frequency: FloatArray) -> tuple[Path, str]:
        """(file, key) of the band of these frequencies."""
        key = fingerprint("shard", code_version("acoustics"), self.stage, self.inputs, frequency)
        return self.folder / f"{self.stage}-{key[:16]}.h5", key


def kept_in(folder: str | Path | None, stage: str, *inputs: Any) -> BandShards | None:
    """Where the bands of a stage with these inputs are kept; without a folder nowhere.

    Makes the folder and tries a file in it: InputError before anything is solved where either fails.
    """
    if not folder:
        return None
    return BandShards(hdf5.writable_folder(folder, "shards"), stage, inputs)
