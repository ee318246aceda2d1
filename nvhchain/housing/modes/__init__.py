"""Modes of the housing, its damping and its forced response."""
