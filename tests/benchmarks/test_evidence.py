"""Tables and pictures of README and the manual, and generated interfaces, are those of this code."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.evidence import item as evidence
from benchmarks.evidence import sources
from benchmarks.evidence.charts import SHOWN
from benchmarks.evidence.drawn import is_drawn_from, keep
from benchmarks.evidence.item import (
    DATA,
    PICTURES,
    PLACE,
    EvidenceError,
    Item,
    changes,
    differences,
    folded,
    make,
    pages,
    read_stamp,
    record_lines,
    restamp,
    run,
    with_tables,
)
from benchmarks.evidence.items import ITEMS
from benchmarks.evidence.page_charts import PAGE_CHARTS, table_of, tables_of
from benchmarks.evidence.sources import controller_digests, generated, object_ids, plain_c
from benchmarks.generated import interfaces
from benchmarks.peers.ours import ONE_NORM
from mambo_codegen import __version__
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.tools import require

ROOT = Path(__file__).parents[2]
NAMES = [item.name for item in ITEMS]


@pytest.mark.parametrize("item", ITEMS, ids=NAMES)
def test_figures_are_those_of_the_generated_c(item: Item) -> None:
    """The C of no controller has changed since they were made; if it has, this names the command."""
    changed = differences(read_stamp(item)["controllers"], controller_digests(item.controllers))
    assert changed == [], (
        f"made with another C of {', '.join(changed)}: python -m benchmarks.evidence {item.name}"
    )


@pytest.mark.parametrize("item", ITEMS, ids=NAMES)
def test_the_stamp_has_every_path_of_the_item(item: Item) -> None:
    """And each exists: a folder that moves is named anew in its items, which are then restamped."""
    assert sorted(read_stamp(item)["paths"]) == sorted(item.paths)
    assert [path for path in item.paths if not (ROOT / path).exists()] == []


@pytest.mark.skipif(".dev" in __version__, reason="a release demands it, a version in development does not")
@pytest.mark.parametrize("item", ITEMS, ids=NAMES)
def test_a_release_has_figures_as_new_as_its_code(item: Item) -> None:
    """No listed path has changed since they were made or restamped."""
    assert changes(item) == [], f"make or restamp it: python -m benchmarks.evidence [--restamp] {item.name}"


@pytest.mark.parametrize("item", ITEMS, ids=NAMES)
def test_a_stamp_has_all_commands_of_its_item(item: Item) -> None:
    """And a line a record; its pictures are there."""
    stamp = read_stamp(item)
    assert item.stamp.read_text("utf-8") == record_lines(stamp) + "\n"
    assert stamp["commands"] == list(item.commands)
    for name in (*item.pictures, *(f"{chart}.png" for chart in item.charts)):
        assert (PICTURES / name).stat().st_size > 10_000, name


def test_headlines_of_charts_are_what_the_figures_say() -> None:
    """The MPC is the closest and crashes least; fixed point saves most, without an FPU and but for AVR."""
    figures = {item.name: read_stamp(item)["figures"] for item in ITEMS if item.charts}
    campaigns = {
        name: one["controllers"] for name, one in figures["opponents"].items() if "controllers" in one
    }
    distances = {
        name: one["quantiles"]["seen_iae_m_s"]["0.5"]
        for name, one in campaigns["drawn"].items()
        if name in SHOWN
    }
    assert min(distances, key=lambda name: distances[name]) == "mambo"
    for campaign in ("slow-motors", "slow-motors-circle"):
        crashes = {name: campaigns[campaign][name]["crashed"]["count"] for name in SHOWN}
        assert min(crashes, key=lambda name: crashes[name]) == "mambo"
    for plain, fixed in zip(
        figures["footprint"]["mambo"], figures["footprint"]["mambo --scalar fixed"], strict=True
    ):
        saves = fixed["instructions"]["mean"] < 0.5 * plain["instructions"]["mean"]
        without_fpu = plain["instructions"]["mean"] > 3000
        assert saves == (without_fpu and plain["name"] != "mega"), plain["name"]


@pytest.mark.parametrize("item", [item for item in ITEMS if item.charts], ids=lambda item: item.name)
def test_a_chart_is_drawn_from_the_figures_of_the_stamp(item: Item) -> None:
    """A stamp with other figures demands other pictures."""
    figures = read_stamp(item)["figures"]
    old = [name for name in item.charts if not is_drawn_from(PICTURES / f"{name}.png", figures)]
    assert old == [], f"python -m benchmarks.evidence {item.name}"


@pytest.mark.parametrize("name", PAGE_CHARTS)
def test_a_chart_of_a_page_is_drawn_from_its_tables(name: str) -> None:
    """And stands on the page."""
    assert is_drawn_from(PICTURES / f"{name}.png", tables_of(name)), (
        "python -m benchmarks.evidence.page_charts"
    )
    assert f"]({name}.png)" in (PICTURES / f"{name}.md").read_text("utf-8")


def test_headlines_of_pages_charts_are_what_their_tables_say() -> None:
    """Derived settings win but on the Mambo; the manoeuvre keeps its errors; hover is refused."""
    (flown,) = tables_of("design")
    for row in flown:
        medians = {
            title: float(cell.split(",")[1])
            for title, cell in row.items()
            if title != "vehicle" and cell.startswith("0,")
        }
        closest = min(medians, key=lambda title: medians[title])
        assert closest == ("preset mambo" if row["vehicle"] == "mambo" else "derived")
    (found,) = tables_of("identify")
    short = [row for row in found if row["flight"] == "manoeuvre, 30 s"]
    assert [round(float(row["lag + dead time, ms"])) for row in short] == [4, 6]
    assert all(float(row["gain"]) < 0.015 for row in short)
    assert found[-1]["flight"] == "hover, 30 s"
    assert found[-1]["verdicts"] == "40 refused"


def test_a_picture_of_other_figures_is_found(tmp_path: Path) -> None:
    """By the digest in the picture; a missing picture and a missing table are found too."""
    picture = tmp_path / "speed.png"
    assert not is_drawn_from(picture, [1])
    keep(PICTURES / "speed.png", picture, [1])
    assert is_drawn_from(picture, [1])
    assert not is_drawn_from(picture, [2])
    with pytest.raises(EvidenceError, match="begins with the titles b"):
        table_of("| a |\n|---|\n| 1 |\n", "b")


def all_tables() -> dict[str, str]:
    """Return the tables of all stamps by name."""
    return {name: text for item in ITEMS for name, text in item.texts(read_stamp(item)["figures"]).items()}


def test_tables_on_pages_are_those_of_the_figures() -> None:
    """No table was edited by hand."""
    tables = all_tables()
    texts = {page: page.read_text("utf-8") for page in pages()}
    wrong = [str(page) for page, text in texts.items() if with_tables(text, tables) != text]
    assert wrong == [], "run python -m benchmarks.evidence"


def test_every_table_is_on_a_page() -> None:
    """Every place is that of a table, and every stamp that of an item, so that none is left over."""
    assert {path.name for path in DATA.iterdir()} == {f"{item.name}.json" for item in ITEMS}
    text = "".join(page.read_text("utf-8") for page in pages())
    assert {place[2] for place in PLACE.finditer(text)} == set(all_tables())
    assert text.count("<!-- table: ") == text.count("<!-- end of table -->") == len(PLACE.findall(text))


def test_a_table_edited_by_hand_is_found() -> None:
    """It is written again between its markers; what surrounds it, and other tables, stay."""
    page = "A\n\n<!-- table: a -->\n{}\n<!-- end of table -->\n\n<!-- table: b -->\n<!-- end of table -->\n"
    written = with_tables(page.format("| 1 |"), {"a": "| 2 |"})
    assert written == page.format("\n| 2 |\n")
    assert with_tables(written, {"a": "| 2 |"}) == written


def test_a_table_of_more_than_fifteen_rows_is_folded() -> None:
    """With its name and the number of rows."""
    short = "\n".join(["| a |", "| - |", *["| 1 |"] * 15])
    assert folded("a", short) == short
    assert "<summary>Table: a b (16 rows)</summary>\n\n| a |" in folded("a-b", f"{short}\n| 1 |")


def test_files_of_settings_are_presets_but_for_what_their_names_say() -> None:
    """The 1-norm without tracker, as in the other benchmarks, and the preset in fixed point."""
    fixed = with_option(presets.load("mambo-1norm"), "code.scalar", "fixed")
    assert presets.load(str(ROOT / "benchmarks/evidence/one-norm.toml")) == ONE_NORM
    assert presets.load(str(ROOT / "benchmarks/evidence/mambo-1norm-fixed.toml")) == fixed


def test_the_lap_of_the_picture_is_that_of_the_tutorial() -> None:
    """Its points are those that a reader writes."""
    points = (ROOT / "benchmarks/evidence/points.csv").read_text("utf-8")
    assert f'title="points.csv"\n{points}```' in (ROOT / "docs/tutorials/lap.md").read_text("utf-8")


C = '/* Words. */\n#define A 1.0f /* more */\n\nconst char *b = "/* no comment */"; // words\n'


def test_comments_are_no_part_of_c() -> None:
    """Neither are spaces; a constant is, and a text that looks like a comment."""
    plain = plain_c(C)
    assert plain == '#define A 1.0f\nconst char *b = "/* no comment */";'
    assert plain_c(C.replace("Words", "Others").replace("A 1", "A   1")) == plain
    assert plain_c(C.replace("1.0f", "1.5f")) != plain
    assert plain_c(C.replace("no comment", "comment")) != plain


def test_a_changed_file_changes_the_id_of_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also before it is committed, and back again; the index of the repository stays as it is."""
    require("git", "git")
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    (tmp_path / "folder").mkdir()
    file, other = tmp_path / "folder/file.py", tmp_path / "other.py"
    file.write_text("X = 1\n", "utf-8")
    other.write_text("X = 1\n", "utf-8")
    sources.git("init", "--quiet")
    first = object_ids(["folder", "other.py"])
    assert sources.git("cat-file", "-p", first["other.py"]) == "X = 1"
    file.write_text("X = 2\n", "utf-8")
    assert differences(first, object_ids(["folder", "other.py"])) == ["folder"]
    file.write_text("X = 1\n", "utf-8")
    assert object_ids(["folder", "other.py"]) == first
    assert sources.git("ls-files") == ""


def test_a_record_is_a_line() -> None:
    """Of figures; of what stands beside them each entry is one, so that two changes seldom meet in a line."""
    stamp = {"paths": {"a": "1", "b": "2"}, "figures": {"x": [{"y": [1, 2], "z": {"w": 0.1}}, {"y": []}]}}
    assert json.loads(record_lines(stamp)) == stamp
    assert record_lines(stamp).splitlines() == [
        *("{", ' "paths": {', '  "a": "1",', '  "b": "2"', " },"),
        *(
            ' "figures": {',
            '  "x": [',
            '   {"y": [1, 2], "z": {"w": 0.1}},',
            '   {"y": []}',
            "  ]",
            " }",
            "}",
        ),
    ]


def test_restamping_runs_nothing_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures and the commit at which they were made stay; what has changed since is listed."""
    require("git", "git")
    monkeypatch.setattr(evidence, "DATA", tmp_path)
    made = Item("made", (), ("mambo",), ("benchmarks/flights/spread.py",), lambda _: {"x": 1}, {})
    assert changes(made) == ["everything: it was never made"]
    said: list[str] = []
    make(made, said.append)
    stamp = read_stamp(made)
    assert (changes(made), stamp["restamped"]) == ([], [])
    now = replace(made, paths=("benchmarks/markdown.py",), commands=("python -c 'raise SystemExit(2)'",))
    assert changes(now) == ["benchmarks/flights/spread.py", "benchmarks/markdown.py"]
    restamp(now, said.append)
    after = read_stamp(now)
    assert changes(now) == []
    assert after["restamped"] == ["benchmarks/flights/spread.py", "benchmarks/markdown.py"]
    assert [after[key] for key in ("figures", "commit")] == [stamp[key] for key in ("figures", "commit")]
    assert "restamped, nothing was run; the figures are those of commit" in said[-1]


def test_figures_depend_on_the_generated_c_and_not_on_its_names(tmp_path: Path) -> None:
    """A weight is part of it; version and settings digest are not."""
    text = (ROOT / "benchmarks/evidence/one-norm.toml").read_text("utf-8")
    other, same = tmp_path / "other.toml", tmp_path / "same.toml"
    other.write_text(text.replace("0.055", "0.056"), "utf-8")
    same.write_text(f"# The same, in other words.\n{text}", "utf-8")
    now = generated("benchmarks/evidence/one-norm.toml")
    assert now == generated(str(same))
    assert now != generated(str(other))
    assert ONE_NORM.short_digest not in now
    assert "optimizer_minimize" in now
    assert generated("mambo") != generated("mambo --scalar fixed")


def test_a_command_that_refuses_is_an_error(tmp_path: Path) -> None:
    """Exit 1 of mambo-nmpc is a finding, such as a bundle that is not there; of Python it is a traceback."""
    assert "missing" in run(f"mambo-nmpc generate table1 --check -o {tmp_path}")
    with pytest.raises(EvidenceError, match="exit 2"):
        run("mambo-nmpc generate table3")
    with pytest.raises(EvidenceError, match="exit 1"):
        run("python -c 'import table3'")


@pytest.mark.long
def test_an_unknown_item_is_refused() -> None:
    """With the names of those that there are."""
    command = [sys.executable, "-m", "benchmarks.evidence", "table3"]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 2
    assert ran.stderr.startswith("table3: is no item of evidence; there are table2, ")


@pytest.mark.parametrize(("path", "text"), [pytest.param(*one, id=one[0].stem) for one in interfaces()])
def test_interfaces_are_those_of_the_declarations(path: Path, text: str) -> None:
    """Of another layout of its records the engine would read and write wrong memory."""
    assert path.read_text("utf-8") == text, "run `make generated`, and commit what changes"
