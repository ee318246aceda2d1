"""Measurements of gear contact and compliance."""
