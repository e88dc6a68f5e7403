"""The program ``impasto``, which ``pip install`` puts beside Python's."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Runs the program by ``sys.argv``, and returns its exit code."""
    # The program handles Ctrl-C by itself where it must, and otherwise ends by it, as programs do.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from ._impasto import command

    return command(sys.argv)


if __name__ == "__main__":
    sys.exit(main())
