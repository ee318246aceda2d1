"""Boundary element systems: engines, dense and compressed matrices, iteration, frequency blocks, checkpoints."""
