"""The server of a live run, for this machine alone: the page, what is new of the run, and what the page asks for."""

from __future__ import annotations

import asyncio
import base64
import json
import socket
import sys
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from missions.errors import ConfigurationError, MissionsError
from missions.files import shown
from missions.runs.setup import resolved
from missions.scenarios.scenario import Scenario
from remoras.cli.live.form import AskedWrongly, RunForm, fields_of, speed_of, time_within, whole_number
from remoras.cli.live.session import Session
from remoras.errors import RemorasError
from visualisation.replay import live_text

LOOPBACK = "127.0.0.1"
LOOK_EVERY_S = 0.1
"""How often the server looks for what is new; the session decides what is."""
LONGEST_BODY = 100_000
NOT_KEPT = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY"}


class Guard:
    """Lets through only what this machine's own page asks: its host and its origin.

    A page of anybody else, open in the same browser, can send requests to the loopback address too.
    """

    def __init__(self, app: ASGIApp, port: int) -> None:
        self._app = app
        self._hosts = {f"{name}:{port}" for name in (LOOPBACK, "localhost")}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        refused = self._refused(scope)
        if refused:
            await JSONResponse({"error": refused}, 403)(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    def _refused(self, scope: Scope) -> str:
        """Why a request is not answered; empty if it is."""
        if scope["type"] != "http":
            return ""
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        host, origin = headers.get("host", ""), headers.get("origin")
        allowed = ", ".join(sorted(self._hosts))
        if host not in self._hosts:
            return f"host {shown(host)} is not served; allowed: {allowed}"
        if origin is not None and origin not in {f"http://{host}" for host in self._hosts}:
            return f"a page of {shown(origin)} may not ask; allowed: pages of {allowed}"
        return ""


class LiveServer:
    """Serves a session to browsers of this machine.

    Args:
        session: the run.
        form: what its page may change.
        first: scenario of its first run.
        listener: socket that listens on the loopback address.
    """

    def __init__(self, session: Session, form: RunForm, first: Scenario, listener: socket.socket) -> None:
        self._session = session
        self._form = form
        self._listener = listener
        self._asking = asyncio.Lock()  # one request changes the run at a time
        self._told: dict[str, Any] = {}
        self._n_states = 0
        self._show(first)
        port = listener.getsockname()[1]
        self.url = f"http://{LOOPBACK}:{port}/"
        routes = [
            Route("/", self._page),
            Route("/events", self._events),
            Route("/control", self._control, methods=["POST"]),
        ]
        app = Starlette(routes=routes, exception_handlers={404: _not_there, 405: _not_there})
        config = uvicorn.Config(
            Guard(app, port), log_level="critical", lifespan="off", timeout_graceful_shutdown=1, server_header=False
        )
        self._server = uvicorn.Server(config)

    def run(self) -> None:
        """Serve until somebody calls ``stop``, or interrupts the program."""
        self._server.run(sockets=[self._listener])

    def stop(self) -> None:
        """End ``run``."""
        self._server.should_exit = True

    def state(self) -> dict[str, Any]:
        """What the page says of the run and of its form, numbered in their order, in which a page may not get them."""
        state = {**self._session.state(), **self._shown}
        if state != self._told:
            self._told = state
            self._n_states += 1
        return {**state, "number": self._n_states}

    def _show(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._shown = {
            "duration_s": scenario.scenario.duration_s,
            "vehicles": [vehicle.name for vehicle in scenario.vehicle],
            "form": fields_of(scenario),
            "allowed": self._form.allowed,
        }

    async def _page(self, request: Request) -> Response:
        name = self._scenario.scenario.name
        return HTMLResponse(live_text(f"{name}, seed {self._session.seed} - live"), headers=NOT_KEPT)

    async def _events(self, request: Request) -> Response:
        return StreamingResponse(self._news(request), media_type="text/event-stream", headers=NOT_KEPT)

    async def _news(self, request: Request) -> AsyncIterator[str]:
        """What is new, as server-sent events, as long as somebody listens."""
        watcher, told = self._session.audience.watch(), ""
        try:
            while not self._server.should_exit and not await request.is_disconnected():
                while watcher.blocks:
                    yield f"event: rows\ndata: {base64.b64encode(watcher.blocks.popleft()).decode()}\n\n"
                if (state := json.dumps(self.state(), allow_nan=False)) != told:
                    told = state
                    yield f"event: state\ndata: {state}\n\n"
                await asyncio.sleep(LOOK_EVERY_S)
        finally:
            self._session.audience.leave(watcher)

    async def _control(self, request: Request) -> Response:
        try:
            asked = await _body(request)
            async with self._asking:
                await run_in_threadpool(self._do, asked)
        except (AskedWrongly, MissionsError, RemorasError) as error:
            return JSONResponse({"error": _reason(error)}, 400)
        return JSONResponse(self.state(), headers=NOT_KEPT)

    def _do(self, asked: Mapping[str, Any]) -> None:
        """What the page asks for; nothing changes unless all of it is right."""
        session = self._session
        match asked:
            case {"do": "play"}:
                session.play()
            case {"do": "pause"}:
                session.pause()
            case {"do": "step"}:
                session.step(whole_number("n", asked.get("n", 1)))
            case {"do": "speed", "speed": speed}:
                session.set_speed(speed_of(speed))
            case {"do": "restart"}:
                scenario, given = self._form.changed(asked.get("form", {}))
                skip_to_s = time_within(asked.get("skip_to_s", 0.0), scenario.scenario.duration_s)
                setup = resolved(scenario)
                self._form.keep(given)
                self._show(setup.scenario)
                session.restart(setup, asked.get("play") is True, skip_to_s)
            case _:
                raise AskedWrongly("do: allowed are play, pause, step, speed, restart")


def _reason(error: Exception) -> str:
    """What is wrong with what the page asked for; of files the name is enough."""
    if isinstance(error, ConfigurationError):
        return "; ".join(fault.text(Path(error.file).name) for fault in error.faults)
    return str(error)


async def _body(request: Request) -> dict[str, Any]:
    if request.headers.get("content-type", "").partition(";")[0] != "application/json":
        raise AskedWrongly("content type: allowed is application/json")
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > LONGEST_BODY:
            raise AskedWrongly(f"longer than {LONGEST_BODY} bytes")
    try:
        found = json.loads(bytes(body))
        json.dumps(found, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise AskedWrongly("half of a surrogate pair, which is no text; allowed is text in UTF-8") from None
    except (ValueError, RecursionError):
        raise AskedWrongly("not JSON") from None
    if not isinstance(found, dict):
        raise AskedWrongly("allowed is a JSON object")
    return found


async def _not_there(request: Request, error: Exception) -> Response:
    status = getattr(error, "status_code", 404)
    return JSONResponse({"error": "served are /, /events and, by POST, /control; no file of this machine is"}, status)


def listener(port: int) -> socket.socket:
    """A socket on the loopback address.

    Raises:
        OSError: the port is taken.
    """
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if sys.platform != "win32":  # there it would let two programs listen on one port
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((LOOPBACK, port))
        found.listen()
    except OSError:
        found.close()
        raise
    return found
