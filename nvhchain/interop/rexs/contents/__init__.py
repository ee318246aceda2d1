"""Contents of a REXS file as they stand, with the names of REXS 2.0 and values in SI units."""
