"""Command line as `python -m nvhchain`, and as the command `nvhchain`."""

import sys


def main() -> int:
    """Run the command line; an interruption while it is being imported ends in a line, too."""
    try:
        from nvhchain.cli import main as command
    except KeyboardInterrupt:
        print("nvhchain: interrupted", file=sys.stderr)
        return 130
    return command()


if __name__ == "__main__":
    try:
        from nvhchain.cli import __main__  # noqa: F401  # runs the command
    except KeyboardInterrupt:
        print("nvhchain: interrupted", file=sys.stderr)
        sys.exit(130)
