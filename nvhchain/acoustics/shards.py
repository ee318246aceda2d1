"""Finished bands of transfer vectors on disk, one whole file each, for a run that may be killed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nvhchain import store
from nvhchain.acoustics.bands import Solved
from nvhchain.acoustics.linear_system import SolverRecord
from nvhchain.conventions import Air
from nvhchain.handoff import FloatArray, Surface, TransferVectors
from nvhchain.resume import code_version, fingerprint, found


@dataclass(frozen=True)
class VectorShards:
    """Bands of one set of transfer vectors.

    settings: what else than surface, points and air the vectors depend on.  A file is used only if it is whole by its
    checksum and if all of these, the band's frequencies and the code agree with those it was made with.
    """

    folder: Path
    surface: Surface
    points: FloatArray
    air: Air
    settings: tuple[Any, ...]

    def find(self, frequency: FloatArray) -> Solved | None:
        """(n_f, n_point, n_face) Pa/(m/s) of the band of these frequencies, None if it has to be solved."""
        path, key = self._place(frequency)
        shard = found(path, TransferVectors, key)
        return Solved(shard.vectors, SolverRecord.of(shard.provenance)) if shard is not None else None

    def keep(self, frequency: FloatArray, solved: Solved) -> None:
        """Save a band: written aside and renamed, so that it is there as a whole or not at all."""
        path, key = self._place(frequency)
        provenance = {"stage": "acoustics.transfer_vectors", "key": key, **solved.record.provenance}
        vectors = TransferVectors(frequency, self.points, solved.values, self.surface, self.air, provenance=provenance)
        store.save(vectors, path)

    def _place(self, frequency: FloatArray) -> tuple[Path, str]:
        """(file, key) of the band of these frequencies."""
        key = fingerprint(
            "shard", code_version("acoustics"), self.surface, self.points, self.air, self.settings, frequency
        )
        return self.folder / f"vectors-{key[:16]}.h5", key
