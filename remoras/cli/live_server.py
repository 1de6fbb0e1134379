"""The server of a live run, for this machine alone: the page, what is new of the run, and what the page asks for."""

from __future__ import annotations

import asyncio
import json
import math
import socket
import tomllib
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from exchange.policies import POLICIES
from missions.errors import MissionsError
from missions.files import toml_value
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.scenarios.scenario import Scenario
from remoras.cli.live_session import Session
from remoras.errors import RemorasError
from remoras.strategies import strategies
from visualisation.replay import live_text

LOOPBACK = "127.0.0.1"
LOOK_EVERY_S = 0.1
LONGEST_BODY = 100_000
LEAST_SPEED, GREATEST_SPEED = 0.1, 10_000.0
MOST_STEPS = 10_000
OF_FORM = ("strategy", "policy", "per", "faults")
KEYS = ("strategy.name", "communication.policy", "channel.per", "fault")
"""Keys of a scenario that the fields of the form set, in their order."""


class AskedWrongly(Exception):
    """The page asked for what cannot be; the message says why."""


@dataclass(frozen=True)
class Settings:
    """What the runs of a session are made of.

    Attributes:
        scenario: name or file.
        overrides: (option, KEY=VALUE) of the command line.
    """

    scenario: str
    overrides: tuple[tuple[str, str], ...]

    def loaded(self, form: Mapping[str, Any]) -> Scenario:
        """The scenario with what the form says in place of the command line.

        Raises:
            AskedWrongly: a field that the form does not have, or a value that it cannot give.
            ConfigurationError: a value out of its range.
        """
        if strange := sorted(set(form) - set(OF_FORM)):
            raise AskedWrongly(f"{', '.join(strange)}: no field of the form; allowed: {', '.join(OF_FORM)}")
        given = {key: form[name] for name, key in zip(OF_FORM, KEYS, strict=True) if form.get(name) is not None}
        kept = [one for one in self.overrides if not any(_sets(one[1], key) for key in given)]
        asked = [
            (name, f"{key}={_value(name, form[name])}") for name, key in zip(OF_FORM, KEYS, strict=True) if key in given
        ]
        return load(self.scenario, [*kept, *asked])


def _sets(override: str, key: str) -> bool:
    name = override.partition("=")[0].strip()
    return name == key or name.startswith(f"{key}.")


def _value(field: str, given: Any) -> str:
    """A field of the form as the value of an option."""
    if field == "per":
        if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
            raise AskedWrongly(f"per {given!r}: allowed is a number, 0 to below 1")
        return toml_value(given)
    if not isinstance(given, str):
        raise AskedWrongly(f"{field}: allowed is a text")
    if field == "faults":
        return toml_value([_fault(line) for line in given.splitlines() if line.strip()])
    known: Sequence[str] = sorted(strategies() if field == "strategy" else POLICIES)
    if given not in known:
        raise AskedWrongly(f"{field} {given[:80]!r}: allowed are {', '.join(known)}")
    return given


def _fault(line: str) -> dict[str, Any]:
    try:
        found: dict[str, Any] = tomllib.loads(f"fault = {{ {line} }}")["fault"]
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        example = 'kind = "lost", vehicle = "AUV01", at_s = 300'
        raise AskedWrongly(f"faults: {line[:80]!r} cannot be read ({error}); write one a line, as: {example}") from None
    return found


def _shown(fault: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {toml_value(value)}" for key, value in fault.items())


class Guard:
    """Lets through only what this machine's own page asks: its host and its origin.

    A page of anybody else, open in the same browser, can send requests to the loopback address too.
    """

    def __init__(self, app: ASGIApp, port: int) -> None:
        self._app = app
        self._hosts = {f"{name}:{port}" for name in (LOOPBACK, "localhost")}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "http":
            headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
            host, origin = headers.get("host", ""), headers.get("origin")
            allowed = ", ".join(sorted(self._hosts))
            refused = ""
            if host not in self._hosts:
                refused = f"host {host[:80]!r} is not served; allowed: {allowed}"
            elif origin is not None and origin.removeprefix("http://") not in self._hosts:
                refused = f"a page of {origin[:80]!r} may not ask; allowed: pages of {allowed}"
            if refused:
                await JSONResponse({"error": refused}, 403)(scope, receive, send)
                return
        await self._app(scope, receive, send)


class LiveServer:
    """Serves a session to browsers of this machine.

    Args:
        session: the run.
        settings: of its command line.
        first: scenario of its first run.
        listener: socket that listens on the loopback address.
    """

    def __init__(self, session: Session, settings: Settings, first: Scenario, listener: socket.socket) -> None:
        self._session = session
        self._settings = settings
        self._scenario = first
        self._form: dict[str, Any] = {}
        self._listener = listener
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
        """What the page says of the run and of its form."""
        scenario = self._scenario
        channel = scenario.channel.model_dump(mode="json", exclude_none=True)
        faults = [fault.model_dump(mode="json", exclude_none=True) for fault in scenario.fault]
        per = channel.get("per")
        return {
            **self._session.state(),
            "duration_s": scenario.scenario.duration_s,
            "form": {
                "strategy": scenario.strategy.name,
                "policy": scenario.communication.policy,
                "per": per if isinstance(per, int | float) else None,
                "faults": "\n".join(_shown(fault) for fault in faults),
            },
            "strategies": sorted({*strategies(), scenario.strategy.name}),
            "policies": sorted({*POLICIES, scenario.communication.policy}),
        }

    async def _page(self, request: Request) -> Response:
        about = self._scenario.scenario
        return HTMLResponse(live_text(f"{about.name}, seed {self._session.seed} - live"), headers=NOT_KEPT)

    async def _events(self, request: Request) -> Response:
        return StreamingResponse(self._told(), media_type="text/event-stream", headers=NOT_KEPT)

    async def _told(self) -> AsyncIterator[str]:
        """What is new, as it comes; who is slow misses what is out of date."""
        n_rows, told = 0, ""
        while not self._server.should_exit:
            if self._session.n_rows != n_rows:
                n_rows = self._session.n_rows
                yield f"event: rows\ndata: {self._session.rows}\n\n"
            if (state := json.dumps(self.state(), allow_nan=False)) != told:
                told = state
                yield f"event: state\ndata: {state}\n\n"
            await asyncio.sleep(LOOK_EVERY_S)

    async def _control(self, request: Request) -> Response:
        try:
            asked = await _body(request)
            await run_in_threadpool(self._do, asked)
        except (AskedWrongly, MissionsError, RemorasError) as error:
            return JSONResponse({"error": str(error)}, 400)
        return JSONResponse(self.state(), headers=NOT_KEPT)

    def _do(self, asked: Mapping[str, Any]) -> None:
        """What the page asks for; nothing changes unless all of it is right."""
        session = self._session
        match asked:
            case {"do": "play"}:
                session.play()
            case {"do": "pause"}:
                session.pause()
            case {"do": "step", **rest}:
                session.step(_whole("n", rest.get("n", 1), MOST_STEPS))
            case {"do": "speed", "speed": speed}:
                session.set_speed(_speed(speed))
            case {"do": "restart", **rest}:
                form = rest.get("form", {})
                if not isinstance(form, dict):
                    raise AskedWrongly("form: allowed is an object of its fields")
                form = {**self._form, **form}
                setup = resolved(self._settings.loaded(form))
                self._form, self._scenario = form, setup.scenario
                session.restart(setup, is_playing=rest.get("play") is True)
            case _:
                raise AskedWrongly("do: allowed are play, pause, step, speed, restart")


NOT_KEPT = {"Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY"}


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
    except (ValueError, RecursionError):
        raise AskedWrongly("not JSON") from None
    if not isinstance(found, dict):
        raise AskedWrongly("allowed is a JSON object")
    return found


def _whole(name: str, given: Any, most: int) -> int:
    if isinstance(given, bool) or not isinstance(given, int) or not 1 <= given <= most:
        raise AskedWrongly(f"{name} {given!r}: allowed is a whole number, 1 to {most}")
    return given


def _speed(given: Any) -> float | None:
    if given == "full":
        return None
    is_number = isinstance(given, int | float) and not isinstance(given, bool)
    if not is_number or not LEAST_SPEED <= given <= GREATEST_SPEED:
        text = f"{LEAST_SPEED:g} to {GREATEST_SPEED:g} times real time, or full"
        raise AskedWrongly(f"speed {given!r}: allowed is {text}")
    return float(given)


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
        found.bind((LOOPBACK, port))
        found.listen()
    except OSError:
        found.close()
        raise
    return found
