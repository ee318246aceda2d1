"""The chain: the order of its steps, their results, and hand-offs supplied from elsewhere."""

from nvhchain.chain.order import record, run, system_modes
from nvhchain.chain.result import Result
from nvhchain.chain.steady_map import SteadyMap, check_states, steady_map

__all__ = ["Result", "steady_map"]
