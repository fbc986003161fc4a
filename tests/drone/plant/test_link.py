"""The link's delays and losses, and the random streams behind all noise."""

import numpy as np
import pytest

from mambo_codegen.methods.shared.inputs import Status
from mambo_sil.drone.plant.link import NOT_CALLED, Drops, Link, Wire
from mambo_sil.drone.plant.randomness import BLOCK, Draws, Purpose, generators


@pytest.mark.parametrize("delays", [(0,), (3,), (0, 1, 3), (2, 2, 0)])
def test_a_command_arrives_after_the_delay_of_its_flight(delays: tuple[int, ...]) -> None:
    """Roll and pitch sent at tick k arrive at tick k + delay, for many ticks; before that, zero tilt."""
    first = np.repeat([[0.0], [0.5]], len(delays), axis=1)
    wire = Wire(Link(delay_ticks=np.array(delays)), first)
    for tick in range(20):
        sent = np.array([[1.0 + tick], [-100.0 - tick]]) + 0.1 * np.arange(len(delays))
        due = tick - np.array(delays)
        expected = np.array([1.0 + due, -100.0 - due]) + 0.1 * np.arange(len(delays))
        np.testing.assert_allclose(wire.carry(sent), np.where(due >= 0, expected, first), rtol=1e-14)


def test_a_link_has_no_delay_and_no_losses_by_default() -> None:
    """Commands arrive at once, and no update is dropped."""
    command_rad = np.array([[0.1], [0.2]])
    assert Wire(Link(), np.zeros((2, 1))).carry(command_rad) is command_rad
    assert Drops(Link(), (0,)).next() is None


def test_every_flight_drops_its_own_share_of_updates() -> None:
    """A share of 0 drops none, a share of 1 all, one between about that many; the seed decides which."""
    shares = np.array([0.0, 0.25, 0.25, 1.0])
    drops = Drops(Link(dropped_share=shares), (3, 4, 5, 6))
    dropped = np.array([drops.next() for _ in range(2000)])
    np.testing.assert_allclose(dropped.mean(axis=0), shares, atol=0.03)
    assert not dropped[:, 0].any()
    assert dropped[:, 3].all()
    assert (dropped[:, 1] != dropped[:, 2]).any()


def test_dropped_updates_come_from_a_stream_of_their_own() -> None:
    """An update is dropped where the flight's uniform number of that purpose is below its share."""
    drops = Drops(Link(dropped_share=0.4), (7,))
    (generator,) = generators((7,), Purpose.DROPS)
    dropped = np.array([drops.next() for _ in range(100)])
    np.testing.assert_array_equal(dropped[:, 0], generator.random(100) < 0.4)


def test_a_dropped_update_has_a_status_that_no_controller_returns() -> None:
    """Traces and their CSV files mark it with -1."""
    assert NOT_CALLED == -1
    assert NOT_CALLED not in set(Status)


@pytest.mark.parametrize("normal", [True, False])
def test_draws_are_the_stream_of_each_flight_whatever_the_block(normal: bool) -> None:
    """Over several blocks each flight draws its own stream, row by row, alone and in a batch."""
    rows = 3 * BLOCK + 5
    batch = Draws((5, 9), Purpose.GUSTS, 3, normal=normal)
    drawn = np.array([batch.next().copy() for _ in range(rows)])  # a row is overwritten with the next block
    for flight, seed in enumerate((5, 9)):
        (generator,) = generators((seed,), Purpose.GUSTS)
        stream = generator.standard_normal((rows, 3)) if normal else generator.random((rows, 3))
        np.testing.assert_array_equal(drawn[:, :, flight], stream)


def test_purposes_and_seeds_have_streams_of_their_own() -> None:
    """The first numbers of all purposes and of several seeds all differ."""
    first = [g.random() for purpose in Purpose for g in generators(range(5), purpose)]
    assert len(set(first)) == len(Purpose) * 5
