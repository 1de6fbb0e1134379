"""The channel model ``network``: measured losses are reproduced per link, and invalid files are refused."""

import re
from itertools import permutations
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.channel.link import Transmission
from exchange.channel.models import Deployment
from exchange.channel.modems import modems
from exchange.channel.network import NetworkChannel, OverRange, network_of, shipped

MODEM = modems()["nanomodem-v3"]
SINGAPORE = "mission-2012"
PUBLISHED = """\
0 .157 .643 .197 .239
.184 0 .870 .639 .435
.326 .826 0 .975 .023
.038 .160 .760 0 .900
.070 .070 .018 .871 0
"""
"""Chitre et al. 2013: rows send, columns hear, nodes 21, 22, 27, 28 and 29."""
TOML = """\
[[network]]
name = "harbour"

[[network.node]]
name = "quay"
position_m = [0.0, 0.0]
depth_m = 3.0
per = { buoy = 0.2 }

[[network.node]]
name = "buoy"
position_m = [300.0, 40.0]
depth_m = 0.0
per = { quay = 0.6 }
"""
CSV = "sender,receiver,per\nA,B,0.1\nB,A,0.9\n"


def fleet(n: int) -> Deployment:
    return Deployment({f"AUV{k:02}": k for k in range(n)}, (0.0,) * n, MODEM, 1000.0, 3600.0)


def rates(channel: NetworkChannel, n: int, seed: int = 1) -> dict[tuple[int, int], float]:
    """Loss rate of each link of a fleet."""
    links = channel.link_model(fleet(n), seed)
    return {(a, b): links.p_loss(Transmission(0, a, 0.0, 512), b, 9.0) for a, b in permutations(range(n), 2)}


# What is reproduced -------------------------------------------------------------------------------


def test_all_twenty_losses_of_the_network_are_reproduced() -> None:
    order = ["21", "22", "27", "28", "29"]
    published = [[float(share) for share in row.split()] for row in PUBLISHED.splitlines()]
    found = rates(NetworkChannel(nodes={f"AUV{k:02}": node for k, node in enumerate(order)}), 5)
    assert found == {(a, b): published[a][b] for a, b in permutations(range(5), 2)}


# Who is which node --------------------------------------------------------------------------------


@given(st.integers(0, 2**61), st.integers(2, 5))
def test_each_vehicle_keeps_its_own_node_when_the_fleet_grows(seed: int, n: int) -> None:
    channel, network = NetworkChannel(), shipped()[SINGAPORE]
    drawn = channel.drawn(network, fleet(n), seed)
    assert len(set(drawn.values())) == n
    assert drawn.items() <= channel.drawn(network, fleet(5), seed).items()
    assert rates(channel, n, seed) == {(a, b): network.per[drawn[a], drawn[b]] for a, b in permutations(range(n), 2)}


# Losses over range --------------------------------------------------------------------------------


@given(
    st.lists(st.tuples(st.floats(0.0, 500.0), st.floats(0.0, 1.0)), min_size=2, max_size=6, unique_by=lambda k: k[0]),
    st.floats(1.0, 800.0),
)
def test_loss_over_range_interpolates_the_measurements(knots: list[tuple[float, float]], range_m: float) -> None:
    table = OverRange(*zip(*sorted(knots), strict=True))
    assert [table.at(knot_m) for knot_m, _ in sorted(knots)] == [per for _, per in sorted(knots)]
    assert min(table.per) <= table.at(range_m) <= max(table.per)
    steps = 4000
    midpoints = sum(table.at((k + 0.5) / steps * range_m) for k in range(steps)) / steps
    assert table.mean(range_m) == pytest.approx(midpoints, abs=2e-3)


# Files --------------------------------------------------------------------------------------------


def test_a_toml_file_and_a_csv_of_the_same_links_are_the_same_channel(tmp_path: Path) -> None:
    toml, table = tmp_path / "harbour.toml", tmp_path / "links.csv"
    toml.write_text(TOML, encoding="utf-8")
    table.write_text("receiver,per,sender,note\nbuoy,0.2,quay,\nquay,0.6,buoy,calm\n", encoding="utf-8")
    for seed in range(5):
        assert rates(NetworkChannel(network=str(toml)), 2, seed) == rates(NetworkChannel(network=str(table)), 2, seed)
    assert network_of(str(toml)).node[1].position_m == (300.0, 40.0)


BAD_TOML = [
    # (what is replaced, by what, key, what the message says)
    ("per = { buoy = 0.2 }", "", "node.quay.per", "the link from quay to buoy is missing"),
    ("buoy = 0.2", "buoy = 1.2", "node.quay.per.buoy", "less than or equal to 1"),
    ("buoy = 0.2", "buoy = nan", "node.quay.per.buoy", "finite number"),
    ("buoy = 0.2", "buoy = 0.2, jetty = 0.1", "node.quay.per.jetty", "is no node; allowed: buoy"),
    ("buoy = 0.2", "buoy = 0.2, quay = 0.1", "node.quay.per.quay", "does not send to itself"),
    ('name = "buoy"', 'name = "quay"', "node.quay", "is there twice"),
    ("[300.0, 40.0]", "[300.0, 4e5]", "node.buoy.position_m.2", "less than or equal to 100000"),
    ("depth_m = 3.0", "depth_m = 12000", "node.quay.depth_m", "less than or equal to 11000"),
    ('name = "harbour"', "", "network.1.name", "missing"),
    (
        'name = "harbour"',
        'name = "../harbour"',
        "network.../harbour.name",
        "allowed: 1 to 40 characters, none of them /",
    ),
    ('name = "harbour"', 'name = "harbour"\nper_over_range = [[1, 0]]', "node", "or else per_over_range"),
    (TOML, '[[network]]\nname = "harbour"\nper_over_range = [[9, 0.1], [8, 0.2]]', "per_over_range", "longer than"),
    (TOML, '[[network]]\nname = "harbour"', "node", "has to be given"),
    (TOML, "name: harbour", "TOML", "at line 1"),
    (TOML, "a = " + "[" * 900 + "]" * 900, "TOML", "recursion depth"),
]


@pytest.mark.parametrize(("part", "by", "key", "says"), BAD_TOML)
def test_an_invalid_network_is_refused_with_its_key(tmp_path: Path, part: str, by: str, key: str, says: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(TOML.replace(part, by, 1), encoding="utf-8")
    faults = list(NetworkChannel(network=str(file)).misfits(fleet(2)))
    assert any(fault.key.endswith(key) and says in fault.allowed for fault in faults), faults
    assert {fault.file for fault in faults} == {str(file)}


BAD_CSV = [
    ("A,B,0.1", "A,B,1.1", 2, "a number from 0 to 1"),
    ("A,B,0.1", "A,A,0.1", 2, "no link of two nodes"),
    ("B,A,0.9", "A,B,0.9", 3, "a second row"),
    ("B,A,0.9\n", "", None, "the link from B to A is missing"),
    ("sender", "from", 1, "sender is missing"),
    ("B,A,0.9", "\n".join(f"A,N{k},0.9" for k in range(99)), None, "at most 100 items"),
    ("B,A,0.9", '"B,A,0.9', 3, "unexpected end"),
]


@pytest.mark.parametrize(("part", "by", "line", "says"), BAD_CSV)
def test_an_invalid_network_csv_is_refused_with_its_line(tmp_path, part, by, line, says):
    file = tmp_path / "bad.csv"
    file.write_text(CSV.replace(part, by, 1), encoding="utf-8")
    (fault,) = NetworkChannel(network=str(file)).misfits(fleet(2))
    assert says in fault.allowed
    assert (fault.file, fault.line) == (str(file), line)


@pytest.mark.parametrize(
    ("channel", "n", "key", "says"),
    [
        (NetworkChannel(network="mission-2021"), 4, "network", "is no network; allowed: .*mission-2012"),
        (NetworkChannel(), 6, "network", "has 5 nodes, the fleet 6 vehicles"),
        (NetworkChannel(nodes={"AUV01": "23"}), 4, "nodes.AUV01", "allowed: 21, 22, 27, 28, 29"),
        (NetworkChannel(nodes={"Raft": "21"}), 4, "nodes.Raft", "is no vehicle; allowed: AUV00"),
        (NetworkChannel(nodes={"AUV00": "21", "AUV02": "21"}), 4, "nodes.AUV00", "is the node of two vehicles"),
    ],
)
def test_a_network_unfit_for_the_fleet_is_refused(channel: NetworkChannel, n: int, key: str, says: str) -> None:
    fault = next(channel.misfits(fleet(n)))
    assert fault.key == key
    assert re.search(says, fault.allowed)
