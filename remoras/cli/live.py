"""Live run with its web server, for the command ``live``."""

from __future__ import annotations

import base64
import json
import math
import re
import sys
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from missions.files import is_number, shown
from remoras.cli.app import shortened
from remoras.process import rare_collections

if TYPE_CHECKING:
    from remoras.api import Run
    from remoras.stepped import Stepping

LOOPBACK = "127.0.0.1"
USUAL_SPEED = 60.0
LEAST_SPEED, GREATEST_SPEED = 0.1, 10_000.0
LONGEST_LAG_S = 0.5
"""Maximum delay (s) that a slow run catches up."""
LEAST_GAP_S = 0.4
"""Minimum interval (s) between updates of a page."""
GREATEST_SHARE = 0.25
"""Maximum share of time spent on updates during a run."""
LONGEST_BODY = 200
"""Maximum size of a control request in bytes."""
NUMBER = re.compile(r"[0-9]{1,15}")
SERVED = "allowed: / and /news?N, and /control by POST; files are not served"
CONTROLS = (
    'allowed are {"do": "start"}, the same with pause or step, and {"do": "speed", "speed": X}, '
    f'X {LEAST_SPEED:g} to {GREATEST_SPEED:g} times real time or "full"'
)
HEADERS = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY"}


class LiveRun:
    """Run displayed and controlled by pages; ``keep`` stores it and describes its results."""

    def __init__(self, stepping: Stepping, duration_s: float, keep: Callable[[Run], str]) -> None:
        self._stepping = stepping
        self._duration_s = duration_s
        self._keep = keep
        self._asked: SimpleQueue[tuple[Callable[[], Any], Future[Any]]] = SimpleQueue()
        self._phase = "ready"
        self._message = ""
        self._reason = ""  # of a crash
        self._speed: float | None = USUAL_SPEED
        self._time_s = 0.0
        self._n_steps = 0
        self._data, self._n_shown, self._data_due_s = "", 0, 0.0
        self._count_from_here()

    @property
    def is_over(self) -> bool:
        """True if the run has finished or crashed."""
        return self._phase in ("finished", "crashed")

    def ask(self, what: Callable[[], Any]) -> Any:
        """Call a function between two steps and return its value; for other threads than ``serve``."""
        # Only the thread of ``serve`` touches the run, so it needs no locks.
        answer: Future[Any] = Future()
        self._asked.put((what, answer))
        return answer.result()

    @rare_collections()
    def serve(self) -> None:
        """Step the run and serve other threads, until an interruption."""
        self._step()  # zero-length step to the state at 0 s
        while True:
            try:
                # A paused run has no next step, but the queue accepts no infinite timeout.
                call, answer = self._asked.get(timeout=min(max(self._until_step_s(), 0.0), LONGEST_LAG_S))
            except Empty:
                if self._until_step_s() <= 0.0:
                    self._step()
            else:
                answer.set_result(call())

    def control(self, do: str, speed: float | None = None) -> None:
        """Start, pause or step an unfinished run, or set its speed (times real time; None: maximum)."""
        if do == "speed":
            self._speed = speed
        elif not self.is_over:
            self._phase = "running" if do == "start" else "paused"
            if do == "step":
                self._step()
        self._count_from_here()

    def news(self, seen: int) -> dict[str, Any]:
        """Return the state of the run, with its data unless the page has number ``seen``."""
        began_s = time.monotonic()
        if self._n_shown < self._n_steps and (self._phase != "running" or began_s >= self._data_due_s):
            self._n_shown = self._n_steps
            try:
                self._data = base64.b64encode(self._stepping.shown(self._reason)).decode()
            except Exception as error:  # invalid rows of a mission table; the run continues
                self._message = f"the update cannot be shown: {error}"
            now_s = time.monotonic()
            self._data_due_s = now_s + max(LEAST_GAP_S, (now_s - began_s) / GREATEST_SHARE)
        return {
            "phase": self._phase, "time_s": self._time_s, "duration_s": self._duration_s, "speed": self._speed,
            "message": self._message, "number": self._n_shown, "data": None if self._n_shown == seen else self._data,
        }  # fmt: skip

    def _count_from_here(self) -> None:
        self._since = (time.monotonic(), self._time_s)

    def _until_step_s(self) -> float:
        if self._phase != "running":
            return math.inf
        if self._speed is None:
            return 0.0
        wall_s, mission_s = self._since
        left_s = wall_s + (self._time_s - mission_s) / self._speed - time.monotonic()
        # A run that is too slow for its speed drops the lag; catching up would show a burst of steps.
        if left_s < -LONGEST_LAG_S:
            self._count_from_here()
        return left_s

    def _step(self) -> None:
        self._n_steps += 1
        try:
            if (state := next(self._stepping, None)) is not None:
                self._time_s = state.time_s
                return
            run = self._stepping.run()
        except (Exception, SystemExit) as error:  # plug-ins may raise anything
            traceback.print_exception(error, file=sys.stderr)
            self._phase, self._reason = "crashed", f"crashed at {self._time_s:.1f} s"
            self._message = f"{type(error).__name__}: {error}; this page keeps the run up to then"
            return
        self._phase = "finished"
        how = "completed" if run.summary["completed"] else f"not completed: {run.summary['reason']}"
        self._message = f"{how}; {self._keep(run)}"


class LiveServer(ThreadingHTTPServer):
    """Local web server of a run; ``port`` 0 takes a free one. OSError if the port is in use."""

    allow_reuse_address = sys.platform != "win32"  # would allow two servers on one port

    def __init__(self, run: LiveRun, page: str, port: int) -> None:
        super().__init__((LOOPBACK, port), LiveRequest)
        self.run, self.page = run, page
        self.hosts = [f"{name}:{self.server_port}" for name in (LOOPBACK, "localhost")]
        self.url = f"http://{self.hosts[0]}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore disconnected browsers."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class LiveRequest(BaseHTTPRequestHandler):
    """Request for the page or an update, or a control."""

    server: LiveServer
    timeout = 10.0

    def parse_request(self) -> bool:
        """Accept requests of this page only, by host and origin."""
        if not super().parse_request():
            return False
        # Foreign pages in the same browser can also send requests to the loopback address.
        hosts, host, origin = self.server.hosts, self.headers.get("Host", ""), self.headers.get("Origin")
        allowed = f"allowed: {', '.join(hosts)}"
        if host not in hosts:
            self.send_error(403, f"host {shown(host)} is not served; {allowed}")
        elif origin is not None and origin not in [f"http://{name}" for name in hosts]:
            self.send_error(403, f"requests from {shown(origin)} are refused; {allowed}")
        else:
            return True
        return False

    def do_GET(self) -> None:
        """Send the page, or with ``/news?N`` an update since number N."""
        path, _, query = self.path.partition("?")
        if self.path == "/":
            self._answer(200, "text/html", self.server.page)
        elif path == "/news" and NUMBER.fullmatch(query):
            news = self.server.run.ask(lambda: self.server.run.news(int(query)))
            self._answer(200, "application/json", json.dumps(news, allow_nan=False))
        else:
            self.send_error(404, SERVED)

    def do_POST(self) -> None:
        """Process a control of the run."""
        length = self.headers.get("Content-Length", "")
        if self.path != "/control":
            self.send_error(404, SERVED)
        elif self.headers.get_content_type() != "application/json":
            self.send_error(415, "content type: allowed is application/json")
        elif not NUMBER.fullmatch(length) or int(length) > LONGEST_BODY:
            self.send_error(413, f"length {shown(length)}: allowed are 0 to {LONGEST_BODY} bytes")
        elif (asked := _control(self.rfile.read(int(length)))) is None:
            self.send_error(400, CONTROLS)
        else:
            self.server.run.ask(lambda: self.server.run.control(*asked))
            self._answer(200, "text/plain", "done\n")

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Send a one-line error, also for errors of ``http.server``."""
        # ``http.server`` answers 501 to a method for which the class has no function.
        status = HTTPStatus.METHOD_NOT_ALLOWED if code == HTTPStatus.NOT_IMPLEMENTED else HTTPStatus(code)
        self._answer(status, "text/plain", f"{shortened(message or status.phrase)}\n")

    def log_message(self, format: str, *args: Any) -> None:
        """Suppress request logs."""

    def _answer(self, status: int, kind: str, text: str) -> None:
        body = text.encode()
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)


def _control(body: bytes) -> tuple[str, float | None] | None:
    """Parse a control: action, and speed for ``speed``; None if invalid."""
    try:
        asked = json.loads(body)
    except ValueError:
        return None
    match asked:
        case {"do": "start" | "pause" | "step" as do, **others} if not others:
            return do, None
        case {"do": "speed", "speed": "full", **others} if not others:
            return "speed", None
        case {"do": "speed", "speed": speed, **others} if not others and is_number(speed):
            return ("speed", float(speed)) if LEAST_SPEED <= speed <= GREATEST_SPEED else None
    return None
