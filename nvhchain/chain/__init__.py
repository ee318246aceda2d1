"""The chain: the order of its steps, their results, and hand-offs supplied from elsewhere."""

from nvhchain.chain.order import record, run
from nvhchain.chain.result import Result

__all__ = ["Result", "record", "run"]
