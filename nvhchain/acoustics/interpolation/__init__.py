"""Transfer vectors between master frequencies: rational interpolation and the adaptive choice of masters."""
