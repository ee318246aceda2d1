"""Gearbox model: shafts, bearings, gear train and lines of action as matrices."""
