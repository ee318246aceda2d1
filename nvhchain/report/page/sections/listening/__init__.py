"""Sections on sound: player, targets, hearing, microphones added afterwards."""
