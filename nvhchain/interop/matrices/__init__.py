"""Superelements of other programs: reduced stiffness and mass."""
