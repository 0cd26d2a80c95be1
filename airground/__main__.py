"""`python -m airground`: the installed command, which belongs to `evaluation`."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points


def main() -> None:
    """Run the command `airground` as the installation names it."""
    commands = entry_points(group="console_scripts", name="airground")
    if not commands:
        print("airground: error: not installed; expected: pip install .", file=sys.stderr)
        sys.exit(2)  # as the command ends with an error
    sys.argv[0] = "airground"
    next(iter(commands)).load()()


if __name__ == "__main__":
    main()
