"""Records of the flights of a campaign, for `fly --repeat`.

The records of the worst flights are files. `campaign_record` makes any other from the database: a
campaign of a million flights would have millions of files.
"""

import contextlib
import json
import re
import sqlite3
from pathlib import Path
from typing import Any, Final

from mambo_codegen import __version__
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.campaign_file import Campaign, scenario
from mambo_sil.experiment.campaign.campaign_flights import DIGEST
from mambo_sil.experiment.campaign.parameters import PARAMETERS, Draw
from mambo_sil.experiment.campaign.store import DATABASE, FlightStore, Value, convert_os_errors, read_flight
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.flight.scenario import Record, write_record
from mambo_sil.results.folders import GENERATOR

RECORDS: Final = "flights"
_NAME: Final = re.compile(r"(\d{6,})-([A-Za-z0-9_-]+)\.json")


def record_name(flight: int, controller: str) -> str:
    """Return the path of a record in the folder of a campaign."""
    return f"{RECORDS}/{flight:06}-{controller}.json"


def write_records(campaign: Campaign, store: FlightStore, flights: dict[str, list[int]]) -> None:
    """Write the missing records of `flights`, by controller; raises UnwritableError."""
    section = campaign.flight
    with convert_os_errors(store.folder):
        (store.folder / RECORDS).mkdir(exist_ok=True)
        for entrant in campaign.entrants:
            for flight in flights[entrant.name]:
                row = store.row(flight)
                path = store.folder / record_name(flight, entrant.name)
                if not _is_written(path, str(row[f"{entrant.name}_{DIGEST}"])):
                    write_record(_record(section, entrant, row), path)


def campaign_record(path: Path) -> Record | None:
    """Return the record that a campaign of this version would have at `path`, from the campaign's database.

    None if there is no such campaign, flight or controller.
    """
    folder, matched = path.parent.parent, _NAME.fullmatch(path.name)
    if matched is None or path.parent.name != RECORDS:
        return None
    try:
        held = json.loads((folder / "campaign.json").read_text("utf-8"))
        if held["generator"] != f"{GENERATOR}{__version__}":
            return None
        documents = {one["name"]: one for one in held["controllers"]}
        document = documents[matched[2]]
        row = read_flight(folder / DATABASE, int(matched[1]))
    except (OSError, ValueError, TypeError, KeyError, sqlite3.Error):
        return None
    if "law" in document:
        document |= {"law": document["law"] | {"named": held["laws"][matched[2]]}}
    vehicle = VehicleFile.model_validate_json(json.dumps(held["vehicle"])).model_dump()
    return _record(held["flight"] | {"vehicle": vehicle}, Entrant.from_document(document), row)


def _record(section: dict[str, Any], entrant: Entrant, row: dict[str, Value]) -> Record:
    """Return the record of a row of the database; `section` is `Campaign.flight`."""
    drawn: Draw = {name: row[name] for name in ("seed", *PARAMETERS)}
    return Record(
        scenario=scenario(section, drawn),
        controller=entrant.controller,
        settings=entrant.settings,
        trace_sha256=str(row[f"{entrant.name}_{DIGEST}"]),
    )


def _is_written(path: Path, digest: str) -> bool:
    """Return whether the record at `path` is whole and of the trace with this digest."""
    with contextlib.suppress(FileNotFoundError):
        return path.read_bytes().endswith(f'"trace_sha256": "{digest}"\n}}\n'.encode())
    return False
