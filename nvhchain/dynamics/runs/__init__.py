"""Runs of the gearbox: steady states, run-ups, recordings, contact loss and linearisation."""
