"""Fused boundary element engine: compiled Burton–Miller matrices of many wavenumbers in one pass."""
