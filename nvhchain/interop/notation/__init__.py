"""Units, names and include files that all readers share."""
