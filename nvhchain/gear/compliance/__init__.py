"""Compliance of flanks, teeth and gear bodies."""
