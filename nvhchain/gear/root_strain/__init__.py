"""Strain at the tooth roots of a running gear."""
