"""Sections over speed: run-ups and steady states."""
