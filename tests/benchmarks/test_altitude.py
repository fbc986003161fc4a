"""The search for the gains of the altitude loop `pid`."""

from benchmarks.gains.altitude import CURVES, DURATION_S, judge
from benchmarks.gains.feedforward import drawn_flights
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.altitude_loops import AltitudeLaw, pid_altitude_gains


def test_the_flights_have_heights_and_the_shipped_gains_follow_closest() -> None:
    """Drawn, with sensors; on the first six of each curve the errors fall from law to law."""
    flights = drawn_flights(CURVES, DURATION_S, count=6, vehicle="crazyflie")
    assert len(flights) == len(CURVES)
    assert all(flight.sensors is not None and flight.given_targets.shape[2] == 9 for flight in flights)
    errors = [judge(flights, AltitudeLaw(name)).error for name in ("stock", "feedforward", "pid")]
    assert errors == sorted(errors, reverse=True)


def test_there_are_gains_for_shipped_drones_only() -> None:
    """Another drone flies those of the Mambo."""
    assert vehicle_toml.DEFAULT in pid_altitude_gains()
    assert set(pid_altitude_gains()) <= set(vehicle_toml.names())
