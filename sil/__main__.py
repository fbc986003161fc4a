"""The command `mambo-nmpc`, imports included: an interrupt ends these as quietly as the command itself."""

import sys

from codegen.errors import INTERRUPTED


def main() -> None:
    """Run the command line; Ctrl-C exits 130 at any time."""
    try:
        from sil import cli  # noqa: PLC0415 - takes a third of a second, in which Ctrl-C may fall

        cli.main()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
