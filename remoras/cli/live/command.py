"""The command that shows a run while it goes: live."""

from __future__ import annotations

import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from remoras.cli.app import command, fail
from remoras.cli.runs import (
    ChannelName,
    ErrorRate,
    NetworkName,
    PolicyName,
    ScenarioName,
    Seed,
    Settings,
    StrategyName,
    overrides_of,
)

NEEDED = ("starlette", "uvicorn")


@command("live", "remoras live mapping-rendezvous --per 0.6")
def live(
    scenario: ScenarioName,
    strategy: StrategyName = None,
    policy: PolicyName = None,
    channel: ChannelName = None,
    network: NetworkName = None,
    per: ErrorRate = None,
    seed: Seed = 1,
    settings: Settings = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results of the last run that finished.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are already in --out.")] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="PORT", help="Port of the page; 0 is any that is free.")
    ] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")] = False,
) -> None:
    """Watch a mission while it runs, and steer it, in a page that only this machine can open."""
    from missions.files import SCENARIO, file_of, shipped

    file_of(SCENARIO, scenario, shipped())  # a name that is mistyped is told before much is loaded
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        fail(f"live needs {' and '.join(missing)}; install with: python -m pip install {' '.join(missing)}")
    import webbrowser

    from missions.runs.folder import check_output
    from missions.runs.setup import resolved
    from missions.scenarios import load
    from remoras.cli.live.form import RunForm
    from remoras.cli.live.server import LiveServer, listener
    from remoras.cli.live.session import Session

    overrides = overrides_of(strategy, policy, channel, network, per, settings or [])
    setup = resolved(load(scenario, overrides))
    if out is not None:
        check_output(out, force)
    try:
        bound = listener(port)
    except OSError as error:
        fail(f"--port {port}: cannot be listened on: {error.strerror}; name another, or 0 for any that is free")
    session = Session(setup, seed, out, force)
    server = LiveServer(session, RunForm(scenario, overrides, setup.scenario), setup.scenario, bound)
    print(server.url, flush=True)
    print("remoras: Ctrl-C ends it", file=sys.stderr)
    if not no_browser:
        webbrowser.open(server.url)
    with suppress(KeyboardInterrupt):  # the usual end
        server.run()
    session.close()
    if session.state()["phase"] not in ("finished", "crashed") and out is not None:
        print(f"remoras: the run was not over; nothing is written to {out}", file=sys.stderr)
