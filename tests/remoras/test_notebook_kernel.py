"""Display of a running simulation in a notebook cell, in a real kernel."""

import base64
import json
import struct
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import remoras
from visualisation.output import DrawingError

pytestmark = pytest.mark.slow

CELL = """import remoras
steps = remoras.stepping("mapping-rendezvous", per=0.6, seed=3, set="scenario.duration_s=900")
steps.watch(speed=600)"""


def shown(code: str, folder: Path) -> list[tuple[str, dict[str, Any]]]:
    """What a cell shows in a kernel: (type of the message, content)."""
    manager = pytest.importorskip("jupyter_client.manager")
    pytest.importorskip("ipykernel")
    started, client = manager.start_new_kernel(cwd=str(folder))
    found: list[tuple[str, dict[str, Any]]] = []

    def note(message: dict[str, Any]) -> None:
        assert message["msg_type"] != "error", message["content"]
        if "data" in message["content"]:
            found.append((message["msg_type"], message["content"]))

    client.execute_interactive(code, output_hook=note, timeout=120)
    client.stop_channels()
    started.shutdown_kernel(now=True)
    return found


def blocks(outputs: list[tuple[str, dict[str, Any]]]) -> list[dict[str, Any]]:
    """What the scripts of a cell tell the page, but for the columns of numbers."""
    found = []
    for _, content in outputs:
        text = content["data"].get("text/html", "")
        if '] = "' in text:
            data = json.loads('"' + text.partition('] = "')[2].partition('"')[0] + '"')
            packed = zlib.decompress(base64.b64decode(data), -15)
            found.append(json.loads(packed[4 : 4 + struct.unpack_from("<I", packed)[0]]))
    return found


def test_the_page_in_a_cell_follows_the_run(tmp_path: Path) -> None:
    all_outputs = shown(CELL, tmp_path)
    outputs = [(kind, content) for kind, content in all_outputs if content.get("transient")]
    pages = [content["transient"]["display_id"] for _, content in outputs]
    assert len(set(pages)) == 2
    assert [kind for kind, _ in outputs[:2]] == ["display_data", "display_data"]
    assert {kind for kind, _ in outputs[2:]} == {"update_display_data"}
    told = blocks(outputs)
    assert len(told) >= 3  # 900 s at 600 a second: 1.5 s, every half second
    ends_s = [block["header"]["end_s"] for block in told]
    assert all(a < b for a, b in pairwise(ends_s))
    assert ends_s[-1] == 900
    assert [block["header"]["is_underway"] for block in told] == [True] * (len(told) - 1) + [False]


def test_outside_a_notebook_the_error_states_the_remedy() -> None:
    steps = remoras.stepping("mapping-rendezvous", set="scenario.duration_s=5")
    with pytest.raises(DrawingError, match=r"^watch: this is no notebook; call run\(\)"):
        steps.watch()
    with pytest.raises(ValueError, match="speed is 0; allowed: above 0"):
        steps.watch(speed=0)
    assert steps.run().summary["mission_time_s"] == 5.0
