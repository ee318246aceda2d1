"""Measurements of gearbox dynamics and of gear pairs with one degree of freedom."""
