"""MCAP by readers that share nothing with the writer.

The container is written by mcap and read by rosbags; messages are written by rosbags and decoded by mcap-ros2-support.
"""

import math
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from missions.figure import Place
from missions.runs.results import Results
from visualisation.exports import Exported, export

NS = 10**9


@pytest.fixture(scope="session")
def mcap(run: Results, places: tuple[Place, ...], tmp_path_factory: pytest.TempPathFactory) -> Exported:
    return export(run, "mcap", tmp_path_factory.mktemp("mcap") / "run.mcap", places=places)


def by_rosbags(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Messages with their times by topic."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path]) as reader:
        for connection, time_ns, data in reader.messages():
            found.setdefault(connection.topic, []).append((time_ns, reader.deserialize(data, connection.msgtype)))
    return found


def by_mcap(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Messages with their times by topic."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as file:
        for _, channel, one, message in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            found.setdefault(channel.topic, []).append((one.log_time, message))
    return found


def test_two_readers_count_the_written_messages(run: Results, mcap: Exported) -> None:
    """A pose and a fix for each row of the trajectories, a packet for each row of the packets."""
    for found in (by_rosbags(mcap.path), by_mcap(mcap.path)):
        assert {topic: len(messages) for topic, messages in found.items()} == mcap.counts
    rows, packets = run.table("trajectories").num_rows, run.table("packets").num_rows
    for ending in ("/pose", "/fix"):
        assert sum(n for topic, n in mcap.counts.items() if topic.endswith(ending)) == rows
    assert mcap.counts["/packets"] == packets
    assert mcap.counts["/scene"] == packets + 1  # places and vehicles at the start


def test_poses_are_the_positions_of_the_table(run: Results, mcap: Exported) -> None:
    rows = [row for row in run.table("trajectories").to_pylist() if row["vehicle"] == "AUV01"]
    for found in (by_rosbags(mcap.path), by_mcap(mcap.path)):
        poses = found["/auv01/pose"]
        for row, (time_ns, message) in zip(rows, poses, strict=True):
            at, turn = message.pose.position, message.pose.orientation
            assert time_ns == round(row["time_s"] * NS)
            assert (at.x, at.y, at.z) == (row["x_m"], row["y_m"], -row["depth_m"])
            heading_rad = 2.0 * math.atan2(turn.z, turn.w)
            assert math.cos(heading_rad - row["heading_rad"]) == pytest.approx(1.0, abs=1e-12)


def test_schemas_have_names_of_foxglove(mcap: Exported) -> None:
    with mcap.path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    schemas = {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()}
    assert schemas.items() >= {
        "/tf": "foxglove_msgs/msg/FrameTransforms", "/auv01/pose": "foxglove_msgs/msg/PoseInFrame",
        "/auv01/fix": "foxglove_msgs/msg/LocationFix", "/scene": "foxglove_msgs/msg/SceneUpdate",
        "/log": "foxglove_msgs/msg/Log", "/auv01/role": "std_msgs/msg/String",
    }.items()  # fmt: skip


def test_packet_messages_name_receivers_and_vehicles_that_lost_them(run: Results, mcap: Exported) -> None:
    rows = run.table("packets").to_pylist()
    for row, (_, message) in zip(rows, by_mcap(mcap.path)["/packets"], strict=True):
        assert (message.slot, message.sender, list(message.receivers)) == (row["slot"], row["sender"], row["receivers"])
        assert list(message.lost_by) == row["lost_by"]
        end_ns = message.end.sec * NS + message.end.nanosec
        assert end_ns == pytest.approx(row["end_s"] * NS, abs=1)


def test_metadata_have_seed_scenario_and_run_key(run: Results, mcap: Exported) -> None:
    with mcap.path.open("rb") as file:
        (record,) = [one for one in make_reader(file).iter_metadata() if one.name == "remoras"]
    assert record.metadata["seed"] == "3"
    assert record.metadata["scenario_toml"] == run.manifest["scenario"]
    assert len(record.metadata["run"]) == 20


def test_run_without_datum_has_poses_but_no_fixes(older: Results, tmp_path: Path) -> None:
    made = export(older, "mcap", tmp_path / "run.mcap")
    topics = by_rosbags(made.path)
    assert [topic for topic in topics if topic.endswith("/pose")] == [
        "/a_quoted_name/pose", "/script/pose", "/vehicle/pose", "/a_b/pose",
    ]  # fmt: skip
    assert not [topic for topic in topics if topic.endswith("/fix")]
    labels = {text.text for entity in topics["/scene"][0][1].entities for text in entity.texts}
    assert labels == {'A "quoted" name', "</script>", "\U0001f420", "a b"}
