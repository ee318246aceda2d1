"""Bearing forces in files of other programs and test systems."""
