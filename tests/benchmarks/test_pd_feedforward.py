"""The search for the gains of the PD with feed-forward."""

from benchmarks.pd_feedforward import DRAWS, FIRST, SLACK, STEPS, Judged, choose, drawn_flights, judge, search
from mambo_sil.flight.controllers.pd import PdController, PdFeedForwardController, PdGains


def bowl(gains: PdGains) -> Judged:
    """Judge gains by their distance from (0.4, 0.3, 0.1); those with a large velocity gain crash."""
    distance = abs(gains.position_rad_m - 0.4) + abs(gains.velocity_rad_s_m - 0.3)
    distance += abs(gains.acceleration_rad_s2_m - 0.1)
    return Judged((1.0 + distance,) * 3, (gains.velocity_rad_s_m,) * 3, int(gains.velocity_rad_s_m > 0.35))


def test_the_search_is_repeatable_and_closes_in() -> None:
    """From the stock gains, whatever crashes left out."""
    found = dict(search(bowl, 0))
    assert list(found) == list(dict(search(bowl, 0)))
    assert FIRST in found
    assert len(found) <= 1 + DRAWS * len(STEPS)
    assert all(gains.velocity_rad_s_m <= 0.35 for gains in found)
    assert min(judged.error_m_s for judged in found.values()) < 1.05


def test_the_calmest_of_the_closest_is_chosen() -> None:
    """A calmer one that is too far off is not, nor is the closest one."""
    closest, calm, far = PdGains(1, 1, 1), PdGains(2, 2, 2), PdGains(3, 3, 3)
    found = {
        closest: Judged((1.0,) * 3, (0.05,) * 3, 0),
        calm: Judged((SLACK - 0.01,) * 3, (0.02,) * 3, 0),
        far: Judged((SLACK + 0.01,) * 3, (0.01,) * 3, 0),
    }
    assert choose(found) == calm


def test_the_flights_are_those_of_a_campaign() -> None:
    """Drawn, with sensors; on the first two of each curve the chosen gains fly closer than the stock PD."""
    flights = drawn_flights(2)
    assert len({flight.seeds for flight in flights}) == 1
    assert all(flight.sensors is not None and flight.disturbances.windy for flight in flights)
    stock, ours = judge(flights, PdController()), judge(flights, PdFeedForwardController())
    assert all(close < far for close, far in zip(ours.iae_m_s, stock.iae_m_s, strict=True))
