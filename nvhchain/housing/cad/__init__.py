"""Housings from CAD files: the part, its seats and bolts, and its elements."""
