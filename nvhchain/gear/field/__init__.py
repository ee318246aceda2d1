"""Displacement and stress of a whole loaded gear."""
