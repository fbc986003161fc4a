"""Make tables and pictures of docs/evidence: those named, or all that are older than the code."""

import sys

from benchmarks.evidence.item import EvidenceError, make, write_tables
from benchmarks.evidence.items import ITEMS


def main(names: list[str]) -> int:
    """Make the named items, or those older than the code; return the exit code."""
    items = {item.name: item for item in ITEMS}
    unknown = [name for name in names if name not in items]
    if unknown:
        print(f"{unknown[0]}: is no item of evidence; there are {', '.join(items)}", file=sys.stderr)
        return 2
    try:
        for item in ITEMS:
            if item.name in names or (not names and item.changed()):
                make(item, print)
            elif not names:
                written = write_tables(item)
                print(
                    f"{item.name}: is as new as the code"
                    + (f"; wrote {', '.join(written)}" if written else "")
                )
    except EvidenceError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
