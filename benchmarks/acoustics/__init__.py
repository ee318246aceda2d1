"""Measurements of boundary elements, transfer vectors, radiation and sound power."""
