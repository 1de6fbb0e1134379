"""The command that reads results without the program that wrote them: verify."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from remoras.cli.app import FAILED, Json, command, fail, show_json


@command("verify", "remoras verify results/run")
def verify(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results folder of a run or a sweep.")],
    as_json: Json = False,
) -> None:
    """Say what in results does not follow from their tables and their scenario, by a checker of its own."""
    from missions.verification import NoResults
    from missions.verification import verify as verified

    try:
        report = verified(folder)
    except NoResults as error:
        fail(str(error))
    if as_json:
        show_json(report.as_json)
    else:
        for line in report.lines:
            print(line)
        n_wrong, n_checked = sum(report.n_findings.values()), sum(report.checked.values())
        print(
            f"{folder}: {n_wrong} of {n_checked} values do not follow"
            if n_wrong
            else f"{folder}: all follows, {n_checked} values"
        )
        for what, why in sorted(report.not_checked.items()):
            print(f"  not checked: {what}: {why}")
    if report.findings:
        raise typer.Exit(FAILED)
