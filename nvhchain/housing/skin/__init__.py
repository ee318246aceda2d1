"""The skin of a meshed housing and its motion on the radiating surface."""
