"""Modal models in universal files and HDF5."""
