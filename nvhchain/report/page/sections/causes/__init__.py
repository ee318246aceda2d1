"""Sections on causes: parts of a difference, contributions, forces and transmission errors."""
