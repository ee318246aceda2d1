"""Measurements of the whole chain: presets, error bands, plans and trade-offs."""
