"""Sections on lines and orders at constant speed."""
