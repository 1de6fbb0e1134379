"""A live run that is served, and a client of it, for the tests of the program and of its page."""

import base64
import http.client
import json
import struct
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.cli.live.form import RunForm
from remoras.cli.live.server import LiveServer, listener
from remoras.cli.live.session import Session

SCENARIO, SEED = "mapping-rendezvous", 3
SHORT = (("--set", "scenario.duration_s=60"), ("--per", "channel.per=0.6"))
LONG = (("--per", "channel.per=0.6"),)
PATIENCE_S = 60.0


def wait_until(what: Callable[[], bool]) -> None:
    until_s = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < until_s, "it takes too long"
        time.sleep(0.02)


def head_of(data: bytes) -> dict[str, Any]:
    """What a block of data says of the run; the columns of numbers behind it are left out."""
    content = zlib.decompress(base64.b64decode(data), -15)
    found: dict[str, Any] = json.loads(content[4 : 4 + struct.unpack_from("<I", content)[0]])
    return found


class Client:
    """What a page, or somebody else, asks of a server."""

    def __init__(self, server: LiveServer, session: Session) -> None:
        self.server, self.session = server, session
        self.port = int(server.url.rstrip("/").rpartition(":")[2])

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> tuple[int, dict[str, Any]]:
        """Status and JSON of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        text = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        given = {"Content-Type": "application/json"} | {
            name.replace("_", "-"): value for name, value in headers.items()
        }
        connection.request(method, path, text, given)
        answer = connection.getresponse()
        content = answer.read().decode()
        connection.close()
        return answer.status, json.loads(content) if content.startswith("{") else {"text": content}

    def control(self, **what: Any) -> dict[str, Any]:
        """State of the run after something that is allowed."""
        status, told = self.ask("POST", "/control", what)
        assert status == 200, told
        return told

    def refused(self, **what: Any) -> str:
        """Why the page may not ask for that."""
        status, told = self.ask("POST", "/control", what)
        assert status == 400, told
        return str(told["error"])

    def blocks(self, until: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
        """Heads of the blocks that a page gets, up to the first that is wanted."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        connection.request("GET", "/events")
        answer = connection.getresponse()
        assert answer.getheader("content-type", "").startswith("text/event-stream")
        found: list[dict[str, Any]] = []
        while not found or not until(found[-1]):
            if answer.readline() == b"event: rows\n":
                found.append(head_of(answer.readline().removeprefix(b"data: ")))
        connection.close()
        return found

    @property
    def phase(self) -> str:
        return str(self.session.state()["phase"])

    @property
    def time_s(self) -> float:
        return float(self.session.state()["time_s"])

    def finished(self) -> None:
        """Let the run go on to its end, at full speed."""
        self.control(do="speed", speed="full")
        self.control(do="play")
        wait_until(lambda: self.phase == "finished")


@contextmanager
def served(overrides: tuple[tuple[str, str], ...], out: Path | None = None) -> Iterator[Client]:
    """A server on a free port, ended afterwards."""
    setup = resolved(load(SCENARIO, overrides))
    session = Session(setup, SEED, out)
    server = LiveServer(session, RunForm(SCENARIO, list(overrides), setup.scenario), setup.scenario, listener(0))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield Client(server, session)
    finally:
        server.stop()
        thread.join()
        session.close()
