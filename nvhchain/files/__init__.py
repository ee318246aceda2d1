"""Files on disk: written whole or not at all, one process at a time in a folder."""
