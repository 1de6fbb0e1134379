"""Tables on a terminal are drawn; into a file or another program go plain lines, as scripts read them."""

import os
import re
import select
import subprocess
import sys
from pathlib import Path

import pytest
from invoked import MAIN

if sys.platform == "win32":
    pytest.skip("needs a terminal of a Unix", allow_module_level=True)
import pty

RULE = "───"


def on_terminal(*arguments: str, **environment: str) -> str:
    """What a command prints on a terminal of 110 columns."""
    ours, theirs = pty.openpty()
    given = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "110", **environment}
    process = subprocess.Popen(
        [sys.executable, "-c", MAIN, *arguments], stdout=theirs, stderr=subprocess.DEVNULL, env=given
    )
    os.close(theirs)
    found = b""
    while select.select([ours], [], [], 60)[0]:
        try:
            more = os.read(ours, 65536)
        except OSError:  # the other end is closed
            break
        if not more:
            break
        found += more
    process.wait(60)
    os.close(ours)
    return found.decode()


def piped(*arguments: str) -> str:
    return subprocess.run([sys.executable, "-c", MAIN, *arguments], capture_output=True, text=True, check=False).stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["list", "policies"], ["policies", "mps-ack-repeat"]),
        (["run", "mapping-rendezvous", "--set", "scenario.duration_s=60"], ["completed", "no", "consultation_done"]),
        (["compare", "SWEPT", "--metric", "n_bytes"], ["n_bytes", "m-ack", "difference to", "p"]),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_table_is_drawn_on_a_terminal_only(arguments: list[str], words: list[str], swept: Path) -> None:
    given = [str(swept) if argument == "SWEPT" else argument for argument in arguments]
    shown, plain = on_terminal(*given), piped(*given)
    assert RULE in shown
    assert RULE not in plain
    assert "\x1b" not in plain
    for word in words:
        assert word in shown
    assert max(len(re.sub(r"\x1b\[[0-9;]*m", "", line).rstrip()) for line in shown.splitlines()) <= 110


def test_colours_are_left_out_where_they_are_not_wanted() -> None:
    assert "\x1b[3" not in on_terminal("list", "policies", NO_COLOR="1")


def test_json_stays_json_on_a_terminal() -> None:
    assert on_terminal("list", "policies", "--json").startswith("[")
