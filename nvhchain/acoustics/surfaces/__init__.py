"""Radiating surfaces: checks, bodies, openings, the reflecting plane and velocities within faces."""
