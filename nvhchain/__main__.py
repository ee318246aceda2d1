"""Command line as `python -m nvhchain`."""

from nvhchain.cli import __main__  # noqa: F401  # runs the command
