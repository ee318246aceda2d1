"""Solid models in Nastran and Abaqus decks."""
