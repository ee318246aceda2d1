"""Command line as `python -m nvhchain`."""

if __name__ == "__main__":
    from nvhchain.cli import __main__  # noqa: F401  # runs the command
