"""The runs of a sweep here, without the processes of their own that take seconds to start."""

import json
import os

import nvhchain as nvh
from nvhchain.errors import InputError
from nvhchain.tradeoff.measure import Cost, Run, resident
from nvhchain.tradeoff.worker import Teller, keys_of


def run_here(case, fidelity, *, out, operators, ledger, watcher):
    """As `measured_run`."""

    class Listener:
        def write(self, line):
            event = json.loads(line)
            if event["event"] == "begin":
                watcher.begin(event["stage"])
            else:
                ledger.enter(event["key"], Cost(event["seconds"], event["processor"], resident(os.getpid())))
                watcher.end(event["stage"], "computed")

        def flush(self):
            pass

    for folder in (out, operators):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        teller = Teller(Listener(), (out, operators))
        result = nvh.run(case, fidelity=fidelity, out=out, operators=operators, watcher=teller)
    except InputError as error:
        return Run({}, str(error))
    return Run(ledger.of(list(keys_of(result))))
