"""Shells, beams, springs, masses and linear relations between nodes with six freedoms."""
