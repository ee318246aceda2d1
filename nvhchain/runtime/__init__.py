"""Means of a run on this machine: processes."""
