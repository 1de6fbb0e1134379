"""Receptions and age of information, on traffic small enough to count by hand."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray
from synthetic_runs import FICTIONS, Fiction

from exchange.channel.network import network_of
from missions.runs.results import Results
from missions.spans import Span
from visualisation.networks import network_figure
from visualisation.run_records import COLLIDED, HEARD, LOST, REFUSED, UNREACHED, Ints, packets_refused
from visualisation.runs import heatmaps, news, tdma
from visualisation.runs.news import RunPackets
from visualisation.shades import matrix


def outcome(heard: NDArray[np.bool_], lost: NDArray[np.bool_]) -> Ints:
    """Nothing collided, nothing was refused."""
    return np.select([heard, lost], [HEARD, LOST], UNREACHED)


def traffic() -> RunPackets:
    """A sends at 0, 20 and 40 s, B at 10 and 30 s, until 50 s. B receives A at 20 s only, A receives B both times."""
    heard = np.array([[0, 0], [1, 0], [0, 1], [1, 0], [0, 0]], dtype=bool)
    lost = np.array([[0, 1], [0, 0], [0, 0], [0, 0], [0, 1]], dtype=bool)
    times_s = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    return RunPackets(("A", "B"), times_s, np.arange(5), np.array([0, 1, 0, 1, 0]), outcome(heard, lost), 50.0)


def test_lost_share_counts_only_packets_of_others() -> None:
    """B lost two of three packets of A, A none of B; own packets do not count."""
    shares = traffic().lost_shares
    assert shares[1, 0] == pytest.approx(2 / 3)
    assert shares[0, 1] == 0.0
    assert np.isnan(shares[0, 0])


def test_matrices_have_a_row_for_each_sender_as_those_of_networks_have() -> None:
    """The cell right of sender A under receiver B is what B lost of A."""
    axes = Figure().subplots()
    matrix(axes, ("A", "B"), traffic().lost_shares, 1.0, "{:.2f}".format, 2.0, 2)
    assert {(text.get_position(), text.get_text()) for text in axes.texts} == {((1, 0), "0.67"), ((0, 1), "0.00")}
    assert axes.images[0].get_array()[0, 1] == pytest.approx(2 / 3)
    network = network_figure(network_of("mission-2012")).axes[-1]
    assert [(one.get_xlabel(), one.get_ylabel()) for one in (axes, network)] == [("receiver", "sender")] * 2


def test_age_of_news_counts_from_the_last_received_packet() -> None:
    ages_s = traffic().ages_s(np.array([5.0, 25.0, 50.0]))
    assert ages_s[1, 0].tolist() == [5.0, 5.0, 30.0]  # from the start, then since 20 s
    assert ages_s[0, 1].tolist() == [5.0, 15.0, 20.0]  # since 10 s, then since 30 s


def test_packets_without_slots_are_drawn_at_their_time() -> None:
    """By the slots that a recording gives them, they would be of three frames."""
    free = replace(traffic(), is_tdma=False, time_s=np.array([0.0, 10.0, 20.0, 30.0, 50.0]))
    assert traffic().frames.tolist() == [0, 0, 1, 1, 2]
    assert free.frames.tolist() == [0, 20, 40, 60, 99]


def test_a_slot_lasts_as_long_where_vehicles_are_silent() -> None:
    """B is silent, or both are in turn, hence 20 or 30 s between packets."""
    for heard_of in ([0, 2, 4], [0, 3]):
        times_s = traffic().time_s[heard_of]
        assert replace(traffic(), time_s=times_s, slot=np.array(heard_of)).slot_s == 10.0


def test_vehicle_out_of_the_mission_has_no_age_of_news() -> None:
    """B is out from 25 s."""
    cut = replace(traffic(), out={"B": [Span(25.0, math.inf)]})
    ages_s = cut.ages_s(np.array([24.0, 25.0, 50.0]))
    assert ages_s[1, 0, 0] == 4.0
    assert np.isnan(ages_s[:, :, 1:]).all()
    never = replace(traffic(), out={"B": [Span(0.0, math.inf)]})
    assert np.isnan(never.ages_s(np.array([0.0, 24.0]))).all()


def test_items_lacking_are_those_sent_but_not_received(tmp_path: Path) -> None:
    """One item is told in each slot of 10 s, by each of 4 vehicles in turn; of 3 listeners one loses it, in turn.

    After all 100 slots 75 items are of others. Each vehicle is one of three listeners to each, who lose one third.
    """
    results = Fiction(vehicles=("A", "B", "C", "D")).write(tmp_path / "run")
    lacking = news.items_lacking(results, np.array([0.0, 11.5, 1000.0]))
    assert lacking[0, 0] == 0.0  # its own item is all there is
    assert lacking[:, 0].sum() == 3.0  # nobody has heard the first one yet
    assert lacking[:, 2].sum() == (news.traffic(results).outcome == LOST).sum() == 100


def test_worst_stretch_has_the_most_losses() -> None:
    """300 slots of two vehicles; only from slot 200 to 235 everything is lost."""
    n = 300
    lost = np.zeros((n, 2), dtype=bool)
    lost[200:236] = True
    lost[np.arange(n), np.arange(n) % 2] = False
    heard = ~lost
    heard[np.arange(n), np.arange(n) % 2] = False
    slots = np.arange(n)
    found = tdma.worst_stretch(RunPackets(("A", "B"), slots * 2.0, slots, slots % 2, outcome(heard, lost), 600.0))
    assert (found.start_s, found.end_s) == (400.0, 472.0)


# Collided and refused ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def collisions(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return FICTIONS["collisions"].write(tmp_path_factory.mktemp("run") / "collisions")


def test_collided_and_refused_packets_count_as_lost(collisions: Results) -> None:
    """100 slots of four, of three listeners one loses; every fourth packet collides there, every fifth is refused."""
    found = news.traffic(collisions)
    assert [(found.outcome == code).sum() for code in (COLLIDED, REFUSED, LOST, HEARD)] == [25, 20, 75, 180]
    n_lost = found.shares_lost(lambda packet, _: (np.zeros_like(packet),), (1,)) * (120 + 180)
    assert n_lost == pytest.approx(120)


def test_refusal_is_matched_to_its_packet_by_arrival_time() -> None:
    """A packet that claims another slot or sender is the same packet."""
    packets = [
        {"slot": 7, "receivers": ["A", "B"], "arrivals_s": [10.5, 10.25]},
        {"slot": 8, "receivers": ["A"], "arrivals_s": [12.5]},
    ]
    refusals = [
        {"vehicle": "B", "slot": 3, "time_s": 10.25}, {"vehicle": "A", "slot": 8, "time_s": 12.4},
        {"vehicle": "C", "slot": 8, "time_s": 12.5}, {"vehicle": "A", "slot": None, "time_s": 1.0},
    ]  # fmt: skip
    assert list(packets_refused(packets, refusals)) == [(0, "B"), (1, "A")]


def test_slots_distinguish_refused_lost_and_collided_packets(collisions: Results, tmp_path: Path) -> None:
    drawn = tdma.picture(collisions)
    (legend,) = drawn.figure.legends
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == ["sent", "received (up)", "refused (up, hollow)", "lost (down)", "collided (down, grey)"]
    assert "Lost by collision: 25 receptions." in drawn.caption
    assert "Refused on arrival and counted as lost: 20 receptions." in drawn.caption
    (quiet,) = tdma.picture(Fiction().write(tmp_path / "quiet")).figure.legends
    assert [text.get_text() for text in quiet.get_texts()] == ["sent", "received (up)", "lost (down)"]


# Links -------------------------------------------------------------------------------------------


def test_link_estimates_equal_those_of_the_table(collisions: Results) -> None:
    """They rise by 1/20 with the number of the peer and over the run; the last peer has none."""
    found = heatmaps.link_estimates(collisions)
    assert found.incoming[1, 0, -1] == pytest.approx(59 / 60 / 20, abs=1e-6)  # of A, as B saw it last before 998.75 s
    assert found.incoming[0, 2, 0] == pytest.approx(2 / 20)
    assert found.outgoing[2, 0] == pytest.approx((2 + 0.5 + 1.0) / 20, abs=1e-6)  # from A to C, as A has it
    assert np.isnan(found.incoming[:, 3]).all()
    assert np.isnan(found.outgoing[3]).all()


def test_peer_stays_parked_until_it_is_received_again(collisions: Results) -> None:
    """Of three others A parks D from 200 to 600 s, B from 250 s on, C from 900 s on."""
    found = heatmaps.link_estimates(collisions)
    shares = {time_s: found.without[3, np.searchsorted(found.at_s, time_s)] for time_s in (190, 210, 300, 700, 950)}
    assert shares == pytest.approx({190: 0.0, 210: 1 / 3, 300: 2 / 3, 700: 1 / 3, 950: 2 / 3})
    assert not found.without[:3].any()


def test_figure_of_links_has_caption_and_percentages(collisions: Results) -> None:
    drawn = heatmaps.links(collisions)
    assert "Crossed: no estimate." in drawn.caption
    numbers = [text.get_text() for text in drawn.figure.axes[2].texts]
    assert numbers == ["10", "15", "5", "15", "5", "10", "5", "10", "15"]


@pytest.mark.parametrize(
    ("events", "span_s"),
    [
        ([(20.0, "parked"), (60.0, "heard again")], (20.0, 60.0)),
        ([(20.0, "parked"), (60.0, "begins anew")], (20.0, 60.0)),
        ([(20.0, "parked"), (60.0, "slot conflict")], (20.0, 1000.0)),
        (  # figures know no feature by which a vehicle gives a peer up
            [(10.0, "slot conflict"), (20.0, "begins anew"), (30.0, "given up"), (40.0, "parked"),
             (50.0, "heard again")], (30.0, 50.0),
        ),
    ],
)  # fmt: skip
def test_parked_span_ends_when_the_peer_is_received(
    tmp_path: Path, events: list[tuple[float, str]], span_s: tuple[float, float]
) -> None:
    parked = [(time_s, "A", "B", event) for time_s, event in events]
    assert heatmaps.spans_without(Fiction(parked=parked).write(tmp_path / "run"), 1000.0)["A", "B"] == [Span(*span_s)]
