"""The parametric casting: outline, solids, mesh and panels."""
