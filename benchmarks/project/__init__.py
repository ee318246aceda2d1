"""The source of the package itself: its size, and how far a value walks through it."""
