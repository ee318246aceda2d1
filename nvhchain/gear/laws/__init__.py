"""Mesh laws, transmission errors and load distributions of a gear pair."""
