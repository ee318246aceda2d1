"""Measurements of the housing."""
