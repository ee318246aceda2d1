"""Accuracy of boundary element results: mesh, interpolation, cancellation and solver errors."""
