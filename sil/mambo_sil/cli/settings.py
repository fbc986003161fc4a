"""The commands of the panel Settings: presets, schema, vehicles, identify, design, diff."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import BuildError, echo
from mambo_codegen.settings.toml_file import PRESETS
from mambo_sil.cli.options import (
    VEHICLE_NAMES,
    AsJson,
    Drone,
    OptionalResults,
    OutputFile,
    Overwrite,
    Results,
    complete_presets,
    complete_vehicles,
    load_drone,
    sensors_option,
    show_result,
    write_file,
)
from mambo_sil.cli.progress import Bar, progress_bar
from mambo_sil.drone.vehicles import VEHICLES
from mambo_sil.errors import FlightError
from mambo_sil.flight.names import SENSORS_KINDS, SensorsKind
from mambo_sil.results.folders import SUMMARY, new_results
from mambo_sil.results.terminal import sentence, table

if TYPE_CHECKING:
    from mambo_codegen.settings.model import Settings
    from mambo_sil.drone.vehicles.vehicle_file import VehicleFile


def list_presets(as_json: AsJson = False) -> None:
    """List the presets and their purpose.

    To choose the settings to start from.
    """
    described = {name: PRESETS.description(name) for name in PRESETS.names()}
    if as_json:
        typer.echo(json.dumps(described, indent=2))
        return
    typer.echo("\n".join(table((), list(described.items()), (0, 1))))


def schema() -> None:
    """Print the JSON schema of controller.toml; editors check and complete TOML with it.

    When you edit settings by hand.
    """
    from mambo_codegen.settings.model import Settings

    typer.echo(json.dumps(Settings.json_schema(), indent=2))


def vehicles(
    name: Annotated[
        str | None,
        typer.Argument(help="Shipped drone whose vehicle.toml to print.", autocompletion=complete_vehicles),
    ] = None,
    *,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of vehicle.toml, for editors.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """List the drones that can be flown, or print the file of one to start from.

    When you describe a drone of your own.
    """
    from mambo_sil.drone.vehicles.vehicle_file import VehicleFile

    if name is not None and (schema or as_json):
        raise typer.BadParameter("it prints a TOML file: leave out --schema and --json", param_hint=name)
    if schema:
        typer.echo(json.dumps(VehicleFile.json_schema(), indent=2))
        return
    if name is not None:
        typer.echo(VEHICLES.text(name), nl=False)
        return
    described = {each: VEHICLES.description(each) for each in VEHICLES.names()}
    if as_json:
        typer.echo(json.dumps(described, indent=2))
        return
    typer.echo("\n".join(table((), list(described.items()), (0, 1))))


def identify(
    logs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Logs of one drone: CSV, trace.csv and that of the Crazyflie's client too; ULog; DataFlash.",
            metavar="LOG...",
        ),
    ] = None,
    *,
    output: Results = Path("identified"),
    columns: Annotated[
        str,
        typer.Option(
            help="Columns of the CSV files by signal, with sign and factor if needed.",
            metavar="SIGNAL=COLUMN,...",
        ),
    ] = "",
    mass_kg: Annotated[
        float | None,
        typer.Option(
            help="Mass with battery, for vehicle.toml: no log shows it. Without it the file has none.",
            metavar="KG",
            min=0.001,
            max=100,
        ),
    ] = None,
    manoeuvre: Annotated[
        Path | None,
        typer.Option(
            help="Instead, write what to fly for a log: waypoints (.csv) or a Crazyflie script (.py).",
            metavar="FILE",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Identify gain, lag and dead time of a drone from flight logs; exit 1 if they do not show them.

    When you have a drone that flies: its log becomes the model for which `design` derives settings.
    """
    if manoeuvre is not None:
        if logs or columns or mass_kg is not None:
            words = "is used without logs, --columns and --mass-kg"
            raise typer.BadParameter(words, param_hint="--manoeuvre")
        from mambo_sil.model.identify.manoeuvre import write_manoeuvre

        typer.echo(write_manoeuvre(manoeuvre))
        return
    if not logs:
        raise typer.BadParameter("name a flight log, or --manoeuvre FILE", param_hint="LOG...")
    from mambo_sil.model.identify.columns import parse_columns
    from mambo_sil.model.identify.curves import curves_csv
    from mambo_sil.model.identify.identify import identify as fit
    from mambo_sil.model.identify.identify import read_logs
    from mambo_sil.model.identify.identify_plots import draw_fit
    from mambo_sil.model.identify.identify_record import CURVES, MODEL, PICTURES, VEHICLE, IdentifySummary
    from mambo_sil.model.identify.identify_report import model_text, vehicle_text

    chosen = parse_columns(columns)
    with progress_bar("reading") as bar:
        read, left_out = read_logs(logs, chosen)
        bar.stage("fitting")
        summary, curves = fit(read, left_out)
        bar.stage("drawing")
        with new_results(output, IdentifySummary.command, (CURVES, *PICTURES, MODEL, VEHICLE)) as folder:
            (folder / CURVES).write_text(curves_csv(curves), "utf-8")
            draw_fit(folder / CURVES, summary.split_s, summary.verdicts, folder / "fit")
            if summary.good:
                (folder / MODEL).write_text(model_text(summary), "utf-8")
                (folder / VEHICLE).write_text(vehicle_text(summary, mass_kg), "utf-8")
            summary.write(folder)
    models = (MODEL, VEHICLE) if summary.good else ()
    show_result(summary, output, (*models, CURVES, *PICTURES, SUMMARY), as_json=as_json)
    if not summary.good:
        raise typer.Exit(1)


def design(
    vehicle: Annotated[
        str,
        typer.Argument(
            help=f"The drone: {', '.join(VEHICLE_NAMES)}, or a vehicle.toml, also that of `identify`.",
            metavar="NAME|FILE",
            autocompletion=complete_vehicles,
        ),
    ],
    *,
    output: OutputFile = Path("controller.toml"),
    force: Overwrite = False,
    sensors: Annotated[
        SensorsKind | None,
        sensors_option(
            SENSORS_KINDS,
            "What measures, in place of the file's sensors",
        ),
    ] = None,
    firm: Annotated[
        bool,
        typer.Option(
            "--firm/--calm",
            help="Firm settings hold their place better in gusts and pushes, and change their commands more.",
        ),
    ] = False,
) -> None:
    """Derive settings from a drone, write them with reasons, fly them; exit 1 if they do not fly well.

    For every drone that is not a shipped one, before you tune anything by hand.
    """
    from mambo_codegen.settings import controller_toml
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.model.derive.derived_flight import choose_settings
    from mambo_sil.model.derive.derived_margins import missing_height
    from mambo_sil.model.derive.reach import reach_words

    source, drone = echo(vehicle), vehicle_toml.load(vehicle)
    if sensors is not None:
        drone = drone.with_sensors(sensors)
    with progress_bar("deriving"):
        chosen = choose_settings(drone, source, _relative(vehicle, output), firm=firm)
    settings = controller_toml.parse(chosen.text, f"settings for vehicle {source}")
    if write_file(chosen.text, output, force=force):
        name = echo(str(output))
        typer.echo(f"wrote {name}; next: mambo-nmpc fly {name}", err=True)
    if settings.height is None:
        typer.echo(sentence(missing_height(drone)), err=True)
    if chosen.small_angles is not None:
        typer.echo(sentence(f"tilt: small angles, since {chosen.small_angles}"), err=True)
    typer.echo(sentence(reach_words(settings)), err=True)
    calm = None
    if firm:
        calm = controller_toml.parse(choose_settings(drone, source).text, source)
    with progress_bar("flying") as bar:
        said, good = _judgement(settings, calm, drone, bar)
    for line in said:
        typer.echo(sentence(line), err=True)
    if not good:
        raise typer.Exit(1)


def _relative(vehicle: str, output: Path) -> str:
    """Return a drone as a settings file in the folder of `output` names it."""
    if vehicle in VEHICLE_NAMES or Path(vehicle).is_absolute():
        return vehicle
    found = os.path.relpath(vehicle, output.parent)
    return f"./{found}" if found in VEHICLE_NAMES else found


def _judgement(
    settings: "Settings", calm: "Settings | None", drone: "VehicleFile", bar: Bar
) -> tuple[list[str], bool]:
    """Return how derived settings fly, here and as an app, with their margins, and whether they fly well.

    Firm ones are compared with `calm`.

    Margins are no verdict; those of what does not fly well are said only if they say why. Without a compiler
    nothing is flown, and nothing refused.
    """
    from mambo_sil.api.app_flights import app_flight_of
    from mambo_sil.flight.flown_settings import FlownSettings
    from mambo_sil.model.derive.derived_flight import (
        firm_words,
        fly_beside,
        fly_derived,
        fly_pushed,
    )
    from mambo_sil.model.derive.derived_margins import judge_margins

    fly_app = app_flight_of(drone)
    try:
        flown = [fly_derived(settings, drone)]
        bar.stage("flying in wind")
        if flown[0].good:
            flown.append(fly_pushed(settings, drone))
            bar.stage("moving the sensors")
            beside = fly_beside(settings, drone)
            flown += [] if beside is None else [beside]
        if calm is not None:
            flown.append(FlownSettings(good=True, words=firm_words(settings, calm, drone)))
        if fly_app is not None:
            bar.stage("flying the app on the desk")
            flown.append(fly_app(settings, drone))
    except BuildError as error:
        where = "flown" if fly_app is None else "flown here nor on the desk,"
        return [f"neither {where} nor margins: {error}"], True
    good, said = all(one.good for one in flown), [one.words for one in flown]
    bar.stage("measuring margins")
    try:
        judged = judge_margins(settings, drone, bar)
        said += judged.lines() if good or judged.warning else []
    except FlightError as error:
        said.append(f"no margins: {error}")
    return said, good


def diff(
    a: Annotated[
        str,
        typer.Argument(
            help="A preset, a controller.toml, or the folder of a bundle.",
            metavar="A",
            autocompletion=complete_presets,
        ),
    ],
    b: Annotated[
        str,
        typer.Argument(help="What to compare it with.", metavar="B", autocompletion=complete_presets),
    ],
    *,
    output: OptionalResults = None,
    vehicle: Drone = None,
    as_json: AsJson = False,
) -> None:
    """Compare two controllers: settings, gains, poles, flights; exit 0 if they are the same, 1 if not.

    After a change of settings: what it does to the flight before you fly it.
    """
    from mambo_codegen.settings import presets
    from mambo_sil.experiment.compare.compare import compare
    from mambo_sil.experiment.compare.diff_report import PICTURES

    sides = [(source, presets.load_or_bundle(source)) for source in (a, b)]
    with progress_bar("flying") as bar:
        summary = compare(sides[0], sides[1], load_drone(vehicle, a, b), output, bar)
    show_result(summary, output, (*(() if summary.same else PICTURES), SUMMARY), as_json=as_json)
    if not summary.same:
        raise typer.Exit(1)
