"""The walks of a reader: which files a packet heard, and a scenario, lead through, and how often one comes to each.

A file is entered once for every file from which it is called. Values that everybody reads (facts, positions, groups,
the view of the organisation, the items of a vehicle) and plug-ins (the mission, the strategy, the policy) are no places
of a walk: they are asked, and ask back, wherever one stands.
"""

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

from exchange.acoustics.channel import Arrival
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load

ROOT = Path(__file__).resolve().parents[2]
OURS = tuple(str(ROOT / package) for package in ("worldmodel", "exchange", "remoras", "missions"))
VALUES = (
    "worldmodel/facts.py", "worldmodel/fields.py", "worldmodel/tbox.py", "worldmodel/store.py",
    "worldmodel/holdings.py", "worldmodel/individuals.py", "exchange/ledger.py", "exchange/packets.py",
    "exchange/schedule.py", "exchange/wire/codes.py", "exchange/wire/codes.py", "remoras/activities.py",
    "remoras/authority.py",
    "remoras/beliefs.py", "remoras/database.py", "remoras/motion.py", "remoras/organisation.py",
    "remoras/picture.py", "remoras/plugins.py", "remoras/sensor.py", "remoras/social/leadership.py",
    "remoras/social/view.py", "remoras/work.py",
)  # fmt: skip
PLUG_INS = ("missions/mapping/", "missions/meeting/", "remoras/strategies/", "exchange/policies.py")
MOST = 2


def entries(walk: Callable[[], object]) -> list[tuple[str, str]]:
    """(from, to) of every step of a walk from one file of ours into another, each once, in order."""
    found: dict[tuple[str, str], None] = {}

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event != "call" or not frame.f_code.co_filename.startswith(OURS) or frame.f_code.co_name.startswith("<"):
            return
        caller = frame.f_back
        while caller is not None and not caller.f_code.co_filename.startswith(OURS):
            caller = caller.f_back
        if caller is not None and caller.f_code.co_filename != frame.f_code.co_filename:
            names = (str(Path(f.f_code.co_filename).relative_to(ROOT)) for f in (caller, frame))
            found.setdefault((next(names), next(names)))

    sys.setprofile(note)
    try:
        walk()
    finally:
        sys.setprofile(None)
    return list(found)


def often(walked: list[tuple[str, str]]) -> dict[str, int]:
    """Files that are places of a walk and are entered too often."""
    places = [
        (one, to) for one, to in walked if not any(file in VALUES or file.startswith(PLUG_INS) for file in (one, to))
    ]
    counted = Counter(to for _, to in places)
    return {name: count for name, count in counted.items() if count > MOST}


def test_a_packet_that_changes_a_plan_enters_no_file_more_than_twice() -> None:
    fleet = assemble(resolved(load("mapping-rendezvous", [("--channel", "channel.name=perfect")])), seed=1)
    heard: list[tuple[int, bytes, float]] = []
    deliver = fleet.deliver

    def noted(arrival: Arrival) -> None:
        heard.append((arrival.receiver, arrival.data, fleet.now_s))
        deliver(arrival)

    fleet.deliver = noted  # type: ignore[method-assign]  # listens in
    while not any(v.social.organisation.members("Operational", "Midfield") for v in fleet.vehicles[2:]):
        fleet.step()
    again = assemble(resolved(load("mapping-rendezvous", [("--channel", "channel.name=perfect")])), seed=1)
    vehicle = again.vehicles[2]

    def hear_and_consult() -> None:
        for node, packet, at_s in heard:
            if node == 2:
                vehicle.hear(packet, at_s)
        vehicle.consult(fleet.now_s)

    walked = entries(hear_and_consult)
    assert ("remoras/radio.py", "exchange/manager.py") in walked
    assert any(to == "remoras/executive/layer.py" for _, to in walked), "the plan has not changed"
    assert often(walked) == {}, "\n".join(f"{one} -> {to}" for one, to in walked)


def test_a_scenario_becomes_a_fleet_without_coming_back_to_a_file() -> None:
    scenario = load("mapping-rendezvous")
    walked = entries(lambda: assemble(resolved(scenario), seed=1))
    assert any(to == "remoras/fleet.py" for _, to in walked)
    assert often(walked) == {}, "\n".join(f"{one} -> {to}" for one, to in walked)
