"""What cannot be asked of ``remoras node`` is one line."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from invoked import refused

NODE = "node", "mapping-rendezvous", "AUV00"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--resume"], "--resume: --out is missing"),
        (["--serial", "/dev/null"], "--serial: --start-utc is missing"),
        (
            ["--serial", "/dev/null", "--bind", "127.0.0.1:47000"],
            "--serial, --unet, --bind and --peers but one",
        ),
        (["--start-utc", "soon"], "--start-utc 'soon': allowed is a time of ISO 8601"),
        (["--start-utc", "1999-01-01T00:00:00"], "allowed is a time within a year of now"),
        (["--start-utc", (datetime.now(UTC) - timedelta(hours=10)).isoformat()], "the mission was over"),
        (["--start-utc", "2026-01-01T00:00:00", "--start", "1"], "leave out one of them"),
    ],
)
def test_options_that_exclude_each_other_are_named(options: list[str], says: str) -> None:
    message = refused(*NODE, *options)
    assert says in message
    assert message.count("\n") == 1


def test_a_port_that_is_none_and_a_log_that_is_none_are_named(tmp_path: Path) -> None:
    now = datetime.now(UTC).isoformat()
    (tmp_path / "AUV00.jsonl").write_text("x\n", encoding="utf-8")
    assert "no line of a log" in refused(*NODE, "--resume", "--out", tmp_path).splitlines()[-1]
    wrong = refused(
        *NODE, "--serial", tmp_path / "none", "--start-utc", now, "--set", "communication.modem=nanomodem-v3"
    )
    assert "No such file or directory; allowed is a serial port" in wrong
