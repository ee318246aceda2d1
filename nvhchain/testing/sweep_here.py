"""Runs of a sweep in this process, without the processes of their own that take seconds to start."""

from __future__ import annotations

import json
import os
from io import StringIO
from pathlib import Path

from nvhchain.case import Case
from nvhchain.chain import run
from nvhchain.errors import InputError
from nvhchain.fidelity import Fidelity
from nvhchain.files.result_cache import Watcher
from nvhchain.tradeoff.measure import Cost, Ledger, Run, resident
from nvhchain.tradeoff.worker import PipeWatcher, keys_of


def run_here(case: Case, fidelity: Fidelity, *, out: Path, operators: Path, ledger: Ledger, watcher: Watcher) -> Run:
    """Run a case as `nvhchain.tradeoff.measure.measured_run` does, but in this process."""

    class Listener(StringIO):
        def write(self, line: str) -> int:
            event = json.loads(line)
            if event["event"] == "begin":
                watcher.begin(event["stage"])
            else:
                ledger.enter(event["key"], Cost(event["seconds"], event["processor"], resident(os.getpid())))
                watcher.end(event["stage"], "computed")
            return len(line)

    for folder in (out, operators):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        teller = PipeWatcher(Listener(), (out, operators))
        result = run(case, fidelity=fidelity, out=out, operators=operators, watcher=teller)
    except InputError as error:
        return Run({}, str(error))
    return Run(ledger.costs_of(list(keys_of(result))))
