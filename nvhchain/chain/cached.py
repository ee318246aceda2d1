"""Results of a run that are in the cache already."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nvhchain.case import Case, GearboxCase
from nvhchain.chain import steps
from nvhchain.chain.running import H, Run
from nvhchain.errors import silence_accuracy_warnings
from nvhchain.fidelity import Fidelity
from nvhchain.files.result_cache import ResultCache, Unwatched
from nvhchain.scene import Scene
from nvhchain.scene import steps as table
from nvhchain.scene.steps import Step


class _MissingError(Exception):
    """A result that is not in the cache."""


class _Found(Unwatched):
    """Watcher that collects the names of results in the cache."""

    def __init__(self) -> None:
        self.names: set[str] = set()

    def end(self, step: str, outcome: str) -> None:
        if outcome == "cached":
            self.names.add(step)


@dataclass(frozen=True)
class _Reading(ResultCache):
    """Result cache in which nothing is computed, written or waited for."""

    def cached(self, name: str, kind: Any, package: str, inputs: Sequence[Any], compute: Any, *, fidelity: Any) -> Any:
        found = self.find(name, kind, package, inputs, fidelity=fidelity)
        if found is None:
            raise _MissingError(name)
        self.watcher.end(name.split("-{key}")[0], "cached")
        return found


class _Looking(Run):
    """Run that has only cached hand-offs."""

    def __getitem__(self, step: Step[H]) -> H:
        if step not in self.hand_offs:
            raise _MissingError(step.name)
        return super().__getitem__(step)


def cached_results(
    case: Case,
    *,
    fidelity: Fidelity,
    out: str | Path,
    operators: str | Path | None = None,
    only: Collection[Step[Any]] | None = None,
) -> set[str]:
    """Return the names of the results that a run would take from the cache; the run itself gives their warnings.

    out: folder of the run. Nothing is written in it.
    operators: folder of the shared operators, if it is another.
    only: steps whose results are looked for; all by default.
    Returns names of files without key and suffix, such as `mesh_law_stage1`.
    """
    found = _Found()
    spine, shared = (_Reading(Path(folder), found) for folder in (out, operators or out))
    run = _Looking(Scene(case, fidelity), spine, shared)
    with silence_accuracy_warnings():
        for step in (step for step in run.scene.steps if only is None or step in only):
            with suppress(_MissingError):
                run.hand_offs[step] = steps.MADE_BY[step](run)
            for part in _parts(run, step) if step not in run.hand_offs else ():
                with suppress(_MissingError):
                    part()
    return found.names


def _parts(run: Run, step: Step[Any]) -> list[Callable[[], Any]]:
    """Return functions of the parts of a step whose result is not whole: laws of stages, transfer vectors of a band."""
    if step is table.MESH_LAWS:
        return [partial(steps.mesh_law, run, number) for number in range(len(run.gearbox.stages))]
    if step is table.TRANSFER_VECTORS and isinstance(run.case, GearboxCase):
        return [partial(steps.transfer_vectors_ahead, run)]
    return []
