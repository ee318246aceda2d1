"""Finite element meshes of gears."""
