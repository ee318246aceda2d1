"""Reduced housings in the formats of other programs."""
