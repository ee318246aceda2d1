"""Gears: geometry, finite element bodies, contact and mesh laws."""
