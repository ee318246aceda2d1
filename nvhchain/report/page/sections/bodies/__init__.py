"""Sections with bodies: housing, modes and gears."""
