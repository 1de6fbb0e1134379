"""The table ``[channel]``: used keys, refusals, effect on receptions."""

import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from conformance import nonconforming_channels as outside
from small_mission import CHANNEL, SMALL, faults_of, line_of, pond, run_varied, with_channel

from exchange.channel.link import GilbertElliott, Transmission
from exchange.channel.shipped import CHANNELS
from missions.runs.assembly import channel_of
from missions.runs.results import identity
from missions.runs.run import Run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.errors import PluginError

SHIPPED = ["ASV00", "AUV00", "AUV01", "AUV02"]
LINKED = """\
[channel]
name = "matrix"
per = 0.2

[[channel.link]]
sender = "Diver"
receiver = "Boat"
per = 0.5

[[channel.link]]
sender = "Boat"
receiver = "Diver"
per = 1.0

[[channel.blackout]]
from_s = 600.0
until_s = 900.0
vehicle = "Diver"
"""
APART = """\
[channel]
name = "perfect"
[[channel.blackout]]
from_s = 600.0
until_s = 900.0
between = [["Boat"], ["Diver"]]
"""
BURSTS = """\
[channel]
name = "gilbert-elliott"
p_good_to_bad = 0.1
p_bad_to_good = 0.3
per_good = 0.05
per_bad = 0.8
"""


def sent(slot: int, sender: int) -> Transmission:
    return Transmission(slot, sender, 0.0, 512)


# What is read -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in CHANNELS if name != "trace"])
def test_models_run_with_default_settings_except_the_trace(name: str):
    scenario = load("mapping-rendezvous", [("--channel", f"channel.name={name}")])
    assert 0.0 <= channel_of(resolved(scenario), 1).link.p_loss(sent(5, 0), 1, 800.0) <= 1.0
    assert 0.0 <= identity(scenario, 1)["per"] <= 1.0


def test_links_and_blackouts_are_mapped_to_slot_owners(tmp_path: Path):
    """Boat is the first vehicle of the file and owns slot 1."""
    channel = channel_of(resolved(pond(tmp_path, with_channel(LINKED))), 1)
    assert (channel.link.p_loss(sent(0, 0), 1, 9.0), channel.link.p_loss(sent(1, 1), 0, 9.0)) == (0.5, 1.0)
    assert [(b.from_s, b.until_s, b.node) for b in channel.blackouts] == [(600.0, 900.0, 0)]


def test_link_states_depend_on_the_seed_of_the_run(tmp_path: Path):
    link = channel_of(resolved(pond(tmp_path, with_channel(BURSTS), "channel.per_bad=0.9")), 7).link
    assert link == GilbertElliott(0.1, 0.3, 0.05, 0.9, seed=7)


@pytest.mark.parametrize(
    ("channel", "per"),
    [
        ('[channel]\nname = "perfect"\n', 0.0),
        (CHANNEL, 0.2),
        (LINKED, 0.75),  # (0.5 + 1.0) / 2
        (LINKED.replace('[[channel.link]]\nsender = "Boat"\nreceiver = "Diver"\nper = 1.0\n', ""), 0.35),
        (BURSTS, 0.2375),  # 3/4 * 0.05 + 1/4 * 0.8
    ],
)
def test_the_summary_has_the_mean_packet_error_rate(tmp_path: Path, channel: str, per: float):
    assert identity(pond(tmp_path, with_channel(channel)), 1)["per"] == pytest.approx(per, rel=1e-12)


@pytest.mark.parametrize("channel", [CHANNEL, LINKED, BURSTS])
@pytest.mark.parametrize("settings", [(), ("channel.name=perfect",), ("channel.name=gilbert-elliott",)])
def test_channel_settings_of_the_manifest_are_read_back(tmp_path: Path, channel: str, settings: tuple[str, ...]):
    """As the manifest has it: settings of a model that was replaced are not in it."""
    scenario = pond(tmp_path, with_channel(channel), *settings)
    again = type(scenario).model_validate_json(scenario.model_dump_json(exclude_none=True))
    assert again == scenario
    table = scenario.channel.model_dump()
    assert set(table) == {"name", "blackout", *CHANNELS[scenario.channel.name].model_fields}


# What is refused ----------------------------------------------------------------------------------

ONE_FAULT = [
    # (channel, replaced, by, key, given, what the message says)
    (LINKED, 'sender = "Diver"', 'sender = "Diner"', "link.1.sender", '"Diner"', "did you mean 'Diver'"),
    (LINKED, 'receiver = "Diver"', 'receiver = "Boat"', "link.2.receiver", '"Boat"', "must not be the sender"),
    (LINKED, 'sender = "Boat"\nreceiver = "Diver"', 'receiver = "Boat"\nsender = "Diver"', "link.2.receiver", '"Boat"',
     "the link from Diver to Boat is listed twice"),
    (LINKED, "per = 1.0", "per = 1.1", "link.2.per", "1.1", "less than or equal to 1"),
    (LINKED, "until_s = 900.0", "until_s = 600.0", "blackout.1.until_s", "600.0", "above from_s = 600.0"),
    (APART, '["Diver"]', "[]", "blackout.1.between.2", "[]", "at least 1 item"),
    (APART, '["Diver"]]', '["Diver"]]\nvehicle = "Boat"', "blackout.1.between", '[["Boat"], ["Diver"]]', "leave one"),
    (BURSTS, "p_good_to_bad = 0.1", "p_good_to_bad = 0.8", "p_good_to_bad", "0.8", "at most 1, not 1.1"),
]  # fmt: skip


@pytest.mark.parametrize(("channel", "old", "new", "key", "given", "says"), ONE_FAULT, ids=[c[2] for c in ONE_FAULT])
def test_fault_of_a_channel_is_one_message_with_its_line(
    tmp_path: Path, channel: str, old: str, new: str, key: str, given: str, says: str
):
    changed = channel.replace(old, new, 1)
    assert changed != channel
    (fault,) = [fault for fault in faults_of(tmp_path, with_channel(changed)) if fault.key == f"channel.{key}"]
    assert fault.given == given
    assert says in fault.allowed
    assert fault.line == line_of(SMALL, "[channel]") + channel[: channel.index(old)].count("\n")


# A model from outside -----------------------------------------------------------------------------

MUD = f"""[channel]
name = "{outside.__name__}:Mud"
clear_per = 0.2
in_mud = "Diver"
layers_m = [1.0, 2]
"""


def test_user_model_has_its_own_settings(tmp_path: Path):
    """Boat owns slot 1, Diver slot 0: 2 of 2 links are in the mud."""
    scenario = pond(tmp_path, with_channel(MUD))
    assert scenario.channel.settings() == outside.Mud(clear_per=0.2, in_mud="Diver", layers_m=(1.0, 2.0))
    three = replace(scenario.deployment, nodes={"Diver": 0, "Boat": 1, "Buoy": 2})
    links = scenario.channel.link_model(three, 1)
    assert (links.p_loss(sent(0, 1), 2, 9.0), links.p_loss(sent(0, 1), 0, 9.0)) == (0.2, 1.0)
    four = replace(three, nodes={**three.nodes, "Raft": 3})
    assert scenario.channel.mean_per(four) == pytest.approx(0.5 + 0.5 * 0.2)


@pytest.mark.parametrize("own", [CHANNEL, LINKED, BURSTS])
def test_user_model_set_by_option_replaces_that_of_the_file(tmp_path: Path, own: str):
    """Settings that the file has for its own model are left aside."""
    channel = pond(tmp_path, with_channel(own), f"channel.name={outside.__name__}:Mud", "channel.clear_per=0.3").channel
    assert channel.settings() == outside.Mud(clear_per=0.3)


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ("clear_per = 0.2", "clear_per = 0.6", "channel.clear_per", "less than or equal to 0.5"),
        ("clear_per = 0.2", "cleer_per = 0.2", "channel.cleer_per", "did you mean 'clear_per'"),
        ("clear_per = 0.2", "per = 0.2", "channel.per", "not used by the .*:Mud channel, only by bern"),
        ('in_mud = "Diver"', 'in_mud = "Driver"', "channel.in_mud", "allowed: Boat, Diver; did you mean 'Diver'?"),
        ("layers_m = [1.0, 2]", "layers_m = [3, 2]", "channel.layers_m", "must be in order"),
        ("layers_m = [1.0, 2]", 'layers_m = [1, "x"]', "channel.layers_m.2", "valid number"),
        ("channels:Mud", "channels:NO_CLASS", "channel.name", "a subclass of .*ChannelModel is needed, not the"),
    ],
)
def test_fault_of_a_user_model_is_one_message_with_its_line(tmp_path: Path, old: str, new: str, key: str, says: str):
    (fault,) = faults_of(tmp_path, with_channel(MUD.replace(old, new)))
    assert fault.key == key
    assert re.search(says, fault.allowed)
    assert fault.line is not None


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Nothing", r"link_model returned None; expected: an object with p_loss\("),
        ("Failing", "link_model raised KeyError: 'sea'"),
        ("WrongMean", r"mean_per returned 20\.0; expected: a number from 0 to 1"),
        ("Telling", "sound_speed_mps returned '1500 m/s'; expected: None or a finite number above 0"),
        ("Misfitting", "raised TypeError: expected SettingFaults, not 'too deep'"),
        ("Grumbling", "its checks of settings raised KeyError: 'sea'"),
    ],
)
def test_model_that_violates_its_interface_is_refused_before_the_run(tmp_path: Path, name: str, says: str):
    (fault,) = faults_of(tmp_path, with_channel(f'[channel]\nname = "{outside.__name__}:{name}"\n'))
    assert fault.key == "channel.name"
    assert re.search(says, fault.allowed)


def test_model_with_a_late_invalid_result_ends_the_run_with_its_name(tmp_path: Path):
    with pytest.raises(PluginError, match=r"nonconforming_channels:Late.*p_loss\(.* returned 1\.5; expected"):
        run_with(tmp_path, {"name": f"{outside.__name__}:Late"})


# In a mission -------------------------------------------------------------------------------------


def run_with(folder: Path, channel: dict[str, Any], seed: int = 1) -> Run:
    return run_varied(folder, lambda raw: raw.update(channel=channel), "scenario.duration_s=150", seed=seed)


def lost_by(run: Run) -> dict[tuple[float, str], set[str]]:
    """Vehicles that lost each packet, by its time and sender."""
    return {(time_s, sender): set(lost) for _, time_s, sender, _, _, _, _, lost, *_ in run.recorder.packets}


def test_blackout_separates_the_fleet_for_exactly_its_time(tmp_path: Path):
    """ASV00 and AUV00 are separated from AUV01 from 30 to 60 s; AUV02 is on no side and receives all."""
    cut = {"from_s": 30.0, "until_s": 60.0, "between": [["ASV00", "AUV00"], ["AUV01"]]}
    packets = lost_by(run_with(tmp_path, {"name": "perfect", "blackout": [cut]}))
    far = {"ASV00": {"AUV01"}, "AUV00": {"AUV01"}, "AUV01": {"ASV00", "AUV00"}, "AUV02": set()}
    assert {sender for time_s, sender in packets if 30.0 <= time_s < 60.0} == set(SHIPPED)
    assert all(lost == (far[who] if 30.0 <= at_s < 60.0 else set()) for (at_s, who), lost in packets.items())


def test_each_seed_loses_different_packets(tmp_path: Path):
    lost = [lost_by(run_with(tmp_path, {"name": "bernoulli", "per": 0.5}, seed)) for seed in range(1, 5)]
    assert all(one != other for one, other in combinations(lost, 2))
