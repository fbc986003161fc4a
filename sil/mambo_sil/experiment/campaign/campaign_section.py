"""The section of the report on a campaign, finished or not."""

from pathlib import Path

from mambo_sil.experiment.campaign.campaign_plots import distribution_panels
from mambo_sil.experiment.campaign.campaign_report import CampaignSummary, UnfinishedCampaign
from mambo_sil.experiment.campaign.statistics import read_table
from mambo_sil.experiment.campaign.store import TABLE
from mambo_sil.flight.flight_report import named
from mambo_sil.flight.names import PD_TITLES
from mambo_sil.results.section import Section


def campaign_section(folder: Path, summary: CampaignSummary | UnfinishedCampaign) -> Section:
    """Return the section of a campaign; raises ResultsError for a table that cannot be read."""
    finished = summary if isinstance(summary, CampaignSummary) else None
    drawn = summary.campaign if isinstance(summary, CampaignSummary) else summary
    path, names = folder / TABLE, [controller.name for controller in drawn.controllers]
    table = read_table(path) if path.is_file() else {}
    found = finished.controllers if finished else {}
    content = {
        "drawn": drawn,
        "summary": finished,
        "folder": str(folder),
        "pictures": distribution_panels(table, names),
        "indices": {
            name: [(*named(index), values) for index, values in one.quantiles.items()]
            for name, one in found.items()
        },
        "improvements": [(named(one.index)[0], one) for one in (finished.improvements if finished else [])],
    }
    if finished is None:
        so_far = len(next(iter(table.values()), ()))
        finding, good = f"not finished, {so_far} flights so far; the same command resumes it", None
    else:
        crashes = ", ".join(f"{one.crashed.count} with {name}" for name, one in found.items())
        finding = f"{finished.flights} flights; crashed: {crashes}"
        good = all(one.crashed.count == 0 for name, one in found.items() if name not in PD_TITLES)
    missing = [] if path.is_file() else [TABLE]
    return Section("campaign", f"Campaign, {drawn.flight.trajectory.text()}", good, finding, content, missing)
