"""Boundary element solutions: surface pressure, transfer vectors, sound power, radiation resistance."""
