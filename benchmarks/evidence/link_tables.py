"""The tables of the flights over MAVLink."""

from benchmarks.evidence.item import Figures
from benchmarks.markdown import table
from mambo_sil.life.records import STACKS
from mambo_sil.results.number_format import three_digits


def link_curves(figures: Figures) -> str:
    """Return a row for each curve, with the errors behind both autopilots."""
    return _errors("curve", figures["curves"])


def link_wires(figures: Figures) -> str:
    """Return a row for each fault of the wire."""
    return _errors("of the messages", figures["wires"])


def _errors(head: str, cases: Figures) -> str:
    """Return the rms and the largest error of each case behind both autopilots."""
    rows = []
    for name, by_stack in cases.items():
        row = {head: name}
        for key, stack in STACKS.items():
            found = by_stack[key]
            row[f"{stack.name}: rms, cm"] = three_digits(found["rms_cm"])
            row[f"{stack.name}: largest, cm"] = three_digits(found["largest_cm"])
        landed = sum(found["landed"] for found in by_stack.values())
        row["landed as planned"] = f"{landed} of {sum(found['flights'] for found in by_stack.values())}"
        rows.append(row)
    return table(rows)


def link_pause(figures: Figures) -> str:
    """Return how far the drone was from the curve, and how many flights landed as planned."""
    rows = [
        {
            "autopilot": stack.name,
            "largest distance, cm": three_digits(figures["pause"][key]["largest_cm"]),
            "landed as planned": f"{figures['pause'][key]['landed']} of 4",
        }
        for key, stack in STACKS.items()
    ]
    return table(rows)


def link_jumps(figures: Figures) -> str:
    """Return by how much a jump moves the command, with and without what the pilot does about it."""
    rows = []
    for size_m, by_stack in figures["jumps"].items():
        row = {"jump": f"{size_m} m"}
        for key, stack in STACKS.items():
            for way, word in (("held", "held"), ("as it is", "not")):
                bump = by_stack[key][way]["bump_deg"]
                row[f"{stack.name}, {word}"] = f"{three_digits(bump)} degrees"
        rows.append(row)
    return table(rows)
