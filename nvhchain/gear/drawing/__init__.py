"""Drawing of a gear pair: geometry, micro-geometry, blanks, misalignment and backlash."""
