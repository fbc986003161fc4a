"""One item of evidence: its commands, its figures, its tables on pages, its pictures, and its stamp.

The stamp docs/evidence/data/NAME.json holds the figures of the tables without rounding, from which they are
written again without a flight, the commit at which they were made, and ids of what they depend on.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure

from benchmarks.evidence.drawn import keep
from benchmarks.evidence.sources import ROOT, controller_digests, git, object_ids
from mambo_sil.results.folders import finite
from mambo_sil.results.pictures import save
from mambo_sil.results.style import style

PICTURES: Final = ROOT / "docs" / "evidence"
DATA: Final = PICTURES / "data"
RESULTS: Final = "build/evidence"

PLACE: Final = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end of table -->)", re.DOTALL)
"""Where a table stands on a page: its beginning, its name, its end; a comment is not shown."""
_LONG_TABLE: Final = 15
"""A table of more rows than that is folded."""

Figures = dict[str, Any]
"""What JSON can hold; a number that is infinite or NaN is null."""


class EvidenceError(Exception):
    """Figures that cannot be made."""


@dataclass(frozen=True)
class Item:
    """Tables and pictures that the same commands make.

    commands:    as a user types them at the root of the repository; each writes below build/evidence/NAME.
    controllers: presets and files whose C flies or is measured, as `mambo` or `mambo --scalar fixed`.
    paths:       folders and files of the repository that compute the figures.
    read:        returns the figures in the folder of the results.
    tables:      return Markdown of figures, by the name that pages have at its place.
    pictures:    files of the results, by their name in docs/evidence.
    draw:        draws pictures that no command draws, into the folder of the results.
    charts:      pictures of the figures, by their name in docs/evidence without its ending.
    variable:    environment variable that the commands want; without it the item is made only by its name.
    """

    name: str
    commands: tuple[str, ...]
    controllers: tuple[str, ...]
    paths: tuple[str, ...]
    read: Callable[[Path], Figures]
    tables: Mapping[str, Callable[[Figures], str]]
    pictures: Mapping[str, str] = field(default_factory=dict)
    draw: Callable[[Path], None] | None = None
    charts: Mapping[str, Callable[[Figures], Figure]] = field(default_factory=dict)
    variable: str = ""

    @property
    def stamp(self) -> Path:
        """The file with figures, and with ids of what they depend on."""
        return DATA / f"{self.name}.json"

    def ids(self) -> dict[str, dict[str, str]]:
        """Return what the figures depend on now: digests of the generated C, git's ids of the paths."""
        return {"controllers": controller_digests(self.controllers), "paths": object_ids(self.paths)}

    def texts(self, figures: Figures) -> dict[str, str]:
        """Return the tables by name."""
        return {name: folded(name, table(figures)) for name, table in self.tables.items()}


def read_stamp(item: Item) -> Figures:
    """Return the stamp of an item."""
    stamp: Figures = json.loads(item.stamp.read_text("utf-8"))
    return stamp


def differences(then: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Return the names whose ids differ."""
    return [name for name in sorted(then.keys() | now.keys()) if then.get(name) != now.get(name)]


def changes(item: Item) -> list[str]:
    """Return the controllers and paths that have changed since the stamp was written."""
    if not item.stamp.is_file():
        return ["everything: it was never made"]
    stamp, now = read_stamp(item), item.ids()
    return [name for kind, ids in now.items() for name in differences(stamp[kind], ids)]


def make(item: Item, say: Callable[[str], None]) -> None:
    """Run the commands of an item; write tables, pictures and the stamp. Raises EvidenceError."""
    results = ROOT / RESULTS / item.name
    shutil.rmtree(results, ignore_errors=True)
    results.mkdir(parents=True)
    ids = item.ids()  # before the commands, lest a source that is changed meanwhile passes for theirs
    start, before = time.monotonic(), _processor_time_s()
    for number, command in enumerate(item.commands):
        say(f"{item.name}: {command}")
        printed = run(command)
        (results / f"printed-{number}.txt").write_text(printed, "utf-8")
    figures = finite(item.read(results))
    if item.draw is not None:
        item.draw(results)
    for name, source in item.pictures.items():
        shutil.copyfile(results / source, PICTURES / name)
    stamp = {
        "commands": list(item.commands),
        "duration_s": round(time.monotonic() - start),
        "processor_time_s": round(_processor_time_s() - before),
        "commit": git("rev-parse", "HEAD"),
        "restamped": [],
        **ids,
        "figures": figures,
    }
    DATA.mkdir(parents=True, exist_ok=True)
    _write_stamp(item, stamp)
    write_tables(item)
    say(f"{item.name}: {', '.join((*item.texts(figures), *item.pictures))}, {stamp['duration_s']} s")


def restamp(item: Item, say: Callable[[str], None]) -> None:
    """Record that what has changed moves no figure. Nothing is run: that is the word of who does this."""
    stamp, changed = read_stamp(item), changes(item)
    stamp |= {
        "commands": list(item.commands),
        "restamped": sorted({*stamp["restamped"], *changed}),
    } | item.ids()
    _write_stamp(item, stamp)
    say(
        f"{item.name}: restamped, nothing was run; the figures are those of commit {stamp['commit'][:9]}, "
        f"and changed since: {', '.join(stamp['restamped']) or 'nothing'}"
    )


def _write_stamp(item: Item, stamp: Figures) -> None:
    item.stamp.write_text(record_lines(stamp) + "\n", "utf-8")


def record_lines(value: Any, level: int = 0) -> str:
    """Return JSON with a line for each entry of the stamp, and in its figures for each record.

    A record is a list of plain values, or an object whose members are plain or hold plain values only.
    """
    if not isinstance(value, dict | list) or (level > 1 and _is_record(value)):
        return json.dumps(value, allow_nan=False)
    parts = [record_lines(member, level + 1) for member in _members(value)]
    if isinstance(value, dict):
        parts = [f"{json.dumps(name)}: {part}" for name, part in zip(value, parts, strict=True)]
    first, last = "{}" if isinstance(value, dict) else "[]"
    inside = ",".join(f"\n{' ' * (level + 1)}{part}" for part in parts)
    return f"{first}{inside}\n{' ' * level}{last}" if parts else f"{first}{last}"


def _members(value: Any) -> Collection[Any]:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()


def _is_plain(value: Any) -> bool:
    """Return whether a value has no list and no object inside."""
    return not any(isinstance(member, dict | list) for member in _members(value))


def _is_record(value: Any) -> bool:
    return _is_plain(value) or (isinstance(value, dict) and all(map(_is_plain, value.values())))


def folded(name: str, table: str) -> str:
    """Return a table, inside an element that opens it if it is long."""
    count = len(table.splitlines()) - 2
    if count <= _LONG_TABLE:
        return table
    summary = f"<summary>Table: {name.replace('-', ' ')} ({count} rows)</summary>"
    return f'<details class="note" markdown="1">\n{summary}\n\n{table}\n\n</details>'


def pages() -> list[Path]:
    """Return README and the pages of the manual."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def with_tables(page: str, tables: Mapping[str, str]) -> str:
    """Return the text of a page with `tables` at their places; other tables stay as they are."""

    def written(place: re.Match[str]) -> str:
        first, name, last = place.groups()
        return f"{first}\n{tables[name]}\n\n{last}" if name in tables else place[0]

    return PLACE.sub(written, page)


def write_tables(item: Item) -> list[str]:
    """Write tables and charts of the figures in the stamp, tables on all pages that have them.

    Returns the changed pages.
    """
    figures = read_stamp(item)["figures"]
    tables = item.texts(figures)
    changed = []
    for page in pages():
        before = page.read_text("utf-8")
        after = with_tables(before, tables)
        if after != before:
            page.write_text(after, "utf-8")
            changed.append(str(page.relative_to(ROOT)))
    draw_charts(item, figures)
    return changed


def draw_charts(item: Item, figures: Figures) -> None:
    """Draw the charts of an item's figures into docs/evidence, with the digest of the figures."""
    results = ROOT / RESULTS / item.name
    results.mkdir(parents=True, exist_ok=True)
    for name, chart in item.charts.items():
        with style():
            png, _ = save(chart(figures), results / name)
        keep(png, PICTURES / png.name, figures)


def run(command: str) -> str:
    """Run a command and return what it printed. Raises EvidenceError; exit 1 of mambo-nmpc is a finding."""
    program, *words = shlex.split(command)
    modules = {"mambo-nmpc": ["-m", "mambo_nmpc"], "python": []}
    ran = subprocess.run(
        [sys.executable, *modules[program], *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False
    )
    if ran.returncode not in ((0, 1) if program == "mambo-nmpc" else (0,)):
        raise EvidenceError(f"{command}: exit {ran.returncode}")
    return ran.stdout


def _processor_time_s() -> float:
    spent = os.times()
    return spent.children_user + spent.children_system
