"""Time integration: exact propagator, mesh force steps and the start from rest."""
