"""The chain: the order of its steps, their results, and hand-offs supplied from elsewhere."""

from nvhchain.chain.order import record, run, system_modes
from nvhchain.chain.result import Result

__all__ = ["Result", "record", "run", "system_modes"]
