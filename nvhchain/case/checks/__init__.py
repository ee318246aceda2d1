"""Checks of a gearbox case as a whole: names, fit of the bodies, strength of the teeth."""
