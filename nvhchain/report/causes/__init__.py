"""Causes of sound: contributions of paths, modes and panels, and the parts of a difference."""
