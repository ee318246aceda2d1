"""Case files as text: their tables, the lines of their keys, and their schema."""
