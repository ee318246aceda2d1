"""Waves outside the body: layer potentials, incident fields and spherical multipoles."""
