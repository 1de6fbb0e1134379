"""A MOOS community beside a node: bytes as MOOS writes them, a body whose place comes from there, and nonsense counted.

The bytes of ``WRITTEN`` were written by ``CMOOSMsg::Serialize`` of core-moos itself (commit ec9c77c), which was
compiled for that; it is no part of these tests. ``by_definition`` builds bytes from the definition in the module.
"""

import math
import struct
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from exchange.drivers import AT_ONCE, Ether
from exchange.drivers.udp import Address, Socket
from missions.nodes import NodePlan, VehicleNode, alone
from missions.nodes.moos import GO, NAV, WAYPOINT, MoosMessage, MoosShare
from missions.scenarios import load
from remoras.cli import app

WRITTEN = {
    MoosMessage("NAV_X", 12.5, 1700000000.25, "uSimMarine", "alpha"): (
        "4a000000070000004e440a0000007553696d4d6172696e650000000005000000616c706861050000004e41565f58"
        "00001040fc54d9410000000000002940000000000000f0bf00000000"
    ),
    MoosMessage("REMORAS_WPT", "point=1.00,-2.50", 1700000000.25, "uSimMarine", "alpha", "aux"): (
        "63000000070000004e530a0000007553696d4d6172696e650300000061757805000000616c7068610b00000052454d4f5241535f575054"
        "00001040fc54d941000000000000f0bf000000000000f0bf10000000706f696e743d312e30302c2d322e3530"
    ),
}
ID = slice(4, 8)
"""Bytes of a number that MOOS keeps for itself: 7 in what was written, -1 in ours."""


def by_definition(
    name: str, number: float, text: bytes = b"", kind: bytes = b"D", what: bytes = b"N", source: str = "pNav"
) -> bytes:
    """A message from the definition: every field in its order, lengths before texts."""
    fields = b"".join(struct.pack("<i", len(one)) + one.encode() for one in (source, "", "alpha", name))
    body = struct.pack("<i", 0) + what + kind + fields
    body += struct.pack("<3d", 1700000000.0, number, -1.0) + struct.pack("<i", len(text)) + text
    return struct.pack("<i", 4 + len(body)) + body


@pytest.mark.parametrize("message", WRITTEN, ids=lambda message: message.name)
def test_messages_are_those_of_moos_to_the_byte(message: MoosMessage) -> None:
    written = bytes.fromhex(WRITTEN[message])
    assert MoosMessage.of(written) == message
    own = message.data
    assert own[: ID.start] + written[ID] + own[ID.stop :] == written


texts = st.text(max_size=20)
values = st.floats(allow_nan=False) | texts | st.binary(max_size=40)


@given(
    st.builds(MoosMessage, st.text(min_size=1, max_size=20), values, st.floats(allow_nan=False), texts, texts, texts)
)
def test_what_is_written_is_read(message: MoosMessage) -> None:
    assert MoosMessage.of(message.data) == message


@given(st.builds(MoosMessage, st.text(min_size=1, max_size=20), values, st.just(0.0), texts), st.data())
def test_a_message_that_is_cut_or_longer_is_none(message: MoosMessage, data: st.DataObject) -> None:
    whole = message.data
    cut = whole[: data.draw(st.integers(0, len(whole) - 1))]
    for given_data in (cut, whole + b"x"):
        with pytest.raises(ValueError, match=r"cut off|no notification"):
            MoosMessage.of(given_data)


@given(st.binary(max_size=120))
def test_nonsense_is_refused_and_never_an_error_of_another_kind(data: bytes) -> None:
    try:
        MoosMessage.of(data)
    except ValueError:
        return
    assert len(data) >= 50  # the least that a message takes


class Community:
    """The other end: what it is told, and the datagrams that it shares."""

    def __init__(self, to: Address) -> None:
        self.port, self._to = Socket(), to

    def share(self, *datagrams: bytes) -> None:
        for data in datagrams:
            self.port.put(data, self._to)

    def told(self, wait_s: float = 0.05) -> list[MoosMessage]:
        found = []
        while self.port.wait(wait_s) and (came := self.port.take()) is not None:
            found.append(MoosMessage.of(came[0]))
        return found


@pytest.fixture
def pair() -> Iterator[tuple[MoosShare, Community]]:
    own = Socket()
    community = Community(own.address)
    share = MoosShare(own, community.port.address, "AUV00")
    yield share, community
    share.close()
    community.port.close()


def taken(share: MoosShare, n: int) -> list[object]:
    """What comes of so many datagrams."""
    until_s, found = time.monotonic() + 5.0, []
    while share.n_taken + share.n_refused < n and time.monotonic() < until_s:
        found.append(share.fix())
    return [*found, share.fix()]


def test_a_fix_is_made_of_what_the_community_shares(pair: tuple[MoosShare, Community]) -> None:
    share, community = pair
    community.share(by_definition("NAV_X", 3.0))
    assert set(taken(share, 1)) == {None}  # no y yet
    community.share(
        *(by_definition(name, value) for name, value in zip(NAV[1:], (-4.0, 135.0, 1.5, 12.0), strict=True))
    )
    fixes = [fix for fix in (*taken(share, 5),) if fix is not None]
    assert fixes
    community.share(by_definition("NAV_X", 6.0), by_definition("NAV_Y", 7.0), by_definition("NAV_ROLL", 1.0))
    fix = [one for one in taken(share, 7) if one is not None][-1]
    # 135 degrees from north, clockwise, is south-east: -45 degrees from east, counter-clockwise
    assert fix == pytest.approx((6.0, 7.0, math.radians(-45.0), 1.5, 12.0, math.nan), nan_ok=True)
    assert share.fix() is None


@pytest.mark.parametrize(
    "bad",
    [
        b"", b"nonsense", by_definition("NAV_X", 1.0)[:-1], by_definition("NAV_X", 1.0, what=b"P"),
        by_definition("NAV_X", 1.0, b"east", kind=b"S"), by_definition("NAV_X", math.nan), by_definition("", 1.0),
        by_definition("NAV_X", 1.0, b"\xff", kind=b"S"), by_definition("NAV_X", math.inf),
        by_definition("NAV_X", 1.0).replace(b"pNav" + bytes(4), b"pNav"),  # a library without the auxiliary source
    ],
    ids=["empty", "nonsense", "cut", "what", "text", "nan", "unnamed", "no text", "infinite", "no auxiliary"],
)  # fmt: skip
def test_what_is_no_place_is_refused_and_counted(pair: tuple[MoosShare, Community], bad: bytes) -> None:
    share, community = pair
    community.share(by_definition("NAV_Y", 2.0), bad)
    assert set(taken(share, 2)) == {None}
    assert (share.n_taken, share.n_refused) == (1, 1)


def test_a_vehicle_whose_body_is_in_a_community_goes_where_the_helm_goes(pair: tuple[MoosShare, Community]) -> None:
    """Two nodes exchange packets; the body of one is moved by a helm, which follows what the node tells it."""
    share, community = pair
    scenario = load("mapping-rendezvous")
    plans = [
        replace(NodePlan.of(scenario, name, 3, 120.0, 0.0), is_steered=name == "AUV00") for name in ("ASV00", "AUV00")
    ]
    own = [alone(plan) for plan in plans]
    ether = Ether(own[0].setup.modem.packet_s)
    nodes = [VehicleNode(own[0], ether.driver(), AT_ONCE), VehicleNode(own[1], ether.driver(), AT_ONCE, body=share)]
    at_m, goals = (3.0, -40.0), []
    while (node := min(nodes, key=lambda one: one.next_s)).next_s < 119.0:
        if node is nodes[1]:
            community.share(by_definition("NAV_X", at_m[0]), by_definition("NAV_Y", at_m[1]), b"noise")
        node.step()
        messages = community.told(0.001) if node is nodes[1] else []
        for name, value in [(message.name, message.value) for message in messages]:
            assert isinstance(value, str)
            if name == WAYPOINT:
                point, _, speed = value.partition("#")
                x_m, y_m = map(float, point.removeprefix("point=").split(","))
                goals.append((x_m, y_m, float(speed.removeprefix("speed="))))
                far_m = math.dist(at_m, (x_m, y_m))
                step = min(1.0, goals[-1][2] / far_m) if far_m else 0.0
                at_m = at_m[0] + step * (x_m - at_m[0]), at_m[1] + step * (y_m - at_m[1])
    assert len(goals) > 30
    assert math.dist(at_m, (3.0, -40.0)) > 20.0
    motion = own[1].solo.vehicle.functional.motion
    assert math.dist((motion.x_m, motion.y_m), at_m) < 3.0
    assert share.n_refused > 30
    share.guide((1.0, 2.0), 0.0)
    assert [(message.name, message.value) for message in community.told()] == [(GO, "false")]
    nodes[1].run()
    share.guide((1.0, 2.0), 1.0)  # closed: nothing is told, and nothing fails
    assert share.fix() is None


def test_a_simulated_vehicle_tells_a_community_where_it_is() -> None:
    """By the command: once a tick, at the speed of the mission, by its modem's name and with no port of its own."""
    community = Community(("127.0.0.1", 9))
    messages: list[MoosMessage] = []
    stop = threading.Event()

    def listen() -> None:
        while not stop.is_set():
            messages.extend(community.told())

    listening = threading.Thread(target=listen)
    listening.start()
    host, port = community.port.address
    command = ["node", "mapping-rendezvous", "AUV00", "--moos", f"{host}:{port}", "--until", "30", "--settle", "0"]
    done = CliRunner().invoke(app, [*command, "--speed", "30", "--json"])
    stop.set()
    listening.join()
    community.port.close()
    assert done.exit_code == 0, done.output
    by_name = {name: [m.value for m in messages if m.name == name] for name in NAV}
    assert {message.community for message in messages} == {"AUV00"}
    assert {message.name for message in messages} == set(NAV)
    assert all(25 <= len(values) <= 120 for values in by_name.values())
    assert set(by_name["NAV_DEPTH"]) == {load("mapping-rendezvous").vehicle[1].depth_m}
    assert all(isinstance(value, float) and 0.0 <= value < 360.0 for value in by_name["NAV_HEADING"])


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--moos-bind", "127.0.0.1:0"), "--moos-bind: --moos is missing"),
        (("--moos", "nowhere"), "--moos nowhere: allowed is HOST:PORT"),
        (("--moos", "127.0.0.1:9", "--moos-bind", "127.0.0.1:x"), "--moos-bind 127.0.0.1:x: allowed is HOST:PORT"),
        (("--moos", "127.0.0.1:9", "--moos-bind", "192.0.2.1:9"), "--moos-bind 192.0.2.1:9: "),
    ],
)
def test_what_is_wrong_is_told_in_a_line(options: tuple[str, ...], says: str) -> None:
    done = CliRunner().invoke(app, ["node", "mapping-rendezvous", "AUV00", *options])
    assert done.exit_code == 2
    assert says in done.stderr
    assert len(done.stderr.splitlines()) == 1
