"""Resources of a run on its machine: threads, memory, processes, workers."""
