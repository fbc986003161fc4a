"""Entry point of `mambo-nmpc` and `python -m mambo_nmpc`: Ctrl-C exits without a traceback at any time."""

import sys


def main() -> None:
    """Run the command line; Ctrl-C exits with 130, also during imports."""
    try:
        from mambo_sil.cli import app  # noqa: PLC0415 - Ctrl-C during the import must exit with 130

        app.main()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
