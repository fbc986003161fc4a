"""Make tables and pictures of docs/evidence: those named, or all that are older than the code."""

import argparse
import os
import sys

from benchmarks.evidence.item import EvidenceError, changes, make, restamp, write_tables
from benchmarks.evidence.items import ITEMS
from benchmarks.evidence.page_charts import draw_page_charts


def main(arguments: list[str]) -> int:
    """Make or restamp the named items, or those older than the code; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.evidence", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(item.name for item in ITEMS))
    parser.add_argument(
        "--restamp", action="store_true", help="run nothing, record that what has changed moves no figure"
    )
    given = parser.parse_args(arguments)
    unknown = [name for name in given.names if name not in {item.name for item in ITEMS}]
    if unknown:
        print(
            f"{unknown[0]}: is no item of evidence; there are {', '.join(item.name for item in ITEMS)}",
            file=sys.stderr,
        )
        return 2
    try:
        for item in ITEMS:
            if given.names and item.name not in given.names:
                continue
            changed = changes(item)
            if changed and item.variable and not given.names and item.variable not in os.environ:
                print(f"{item.name}: changed since it was made, and left as it is: set {item.variable}")
                continue
            if given.names or changed:
                print(f"{item.name}: changed since it was made: {', '.join(changed) or 'nothing'}")
                (restamp if given.restamp else make)(item, print)
            else:
                written = write_tables(item)
                print(
                    f"{item.name}: is as new as the code"
                    + (f"; wrote {', '.join(written)}" if written else "")
                )
        print("charts of pages:", ", ".join(draw_page_charts()) or "as new as their tables")
    except EvidenceError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
