"""Housings from models and modes of other programs."""
