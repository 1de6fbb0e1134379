"""Judging: the split of a suite that nobody has seen, made of seeds that are released after the version they judge.

Beside a suite a file in the folder ``test`` says of which ground others are drawn, by what, and the SHA-256 of the list
of their seeds: so the list cannot be changed afterwards, and cannot be tuned on before.
"""

from __future__ import annotations

import hashlib
import tomllib
from dataclasses import replace
from pathlib import Path

import tomli_w
from pydantic import Field, ValidationError

from exchange.acoustics.loss import STATES
from missions.benchmark.suite import DRAWN, DrawnGrounds, Suite
from missions.disk import write_synced
from missions.document import Document
from missions.errors import OutputError
from missions.files import shipped, text_of
from missions.scenarios.tables import Section
from remoras.plugins import named_object


class JudgingTable(Section):
    """The file of a split to be judged by."""

    ground: str = Field(description="shipped scenario of which others are drawn")
    generator: str = Field(description="package.module:object that draws the tables of one of a seed")
    seeds_sha256: str = Field(pattern="^[0-9a-f]{64}$", description="digest of the list of seeds")


def judging_of(suite: Suite) -> JudgingTable:
    """What is released of the split of a suite to be judged by.

    Raises:
        OutputError: there is nothing.
        ConfigurationError: with every fault of the file.
    """
    path = Path(suite.document.path)
    path = path.parent / "test" / path.name
    if not path.is_file():
        raise OutputError(f"--split test: {suite.about.name} has none: {path} is missing; allowed: dev")
    document = Document.of_text(text_of(path), str(path))
    try:
        return JudgingTable.model_validate(document.raw)
    except ValidationError as error:
        raise document.error(document.faults_of(error, JudgingTable)) from None


def split_to_judge(suite: Suite, seeds: Path | None, folder: Path) -> Suite:
    """The split of a suite to be judged by.

    Args:
        suite: as it is to develop on.
        seeds: file with the seeds, one in a line.
        folder: where drawn grounds are written.

    Raises:
        OutputError: there is no such split, its seeds are not out, or the file is another list.
        ConfigurationError: a ground that was drawn cannot be.
    """
    judging = judging_of(suite)
    digest, name = judging.seeds_sha256, suite.about.name
    if seeds is None:
        when = f"the seeds of {name} have the sha256 {digest[:12]} and are released with the next version"
        raise OutputError(f"--split test: --seeds FILE is missing; {when}")
    text = text_of(seeds)
    if (given := hashlib.sha256(text.encode()).hexdigest()) != digest:
        raise OutputError(f"--seeds {seeds}: sha256 = {given[:12]}; allowed: {digest[:12]}, the seeds of {name}")
    draw = named_object(judging.generator)
    tables = tomllib.loads(text_of(shipped()[judging.ground]))
    paths = []
    for number, line in enumerate(text.splitlines(), 1):
        if not (line.isdecimal() and int(line) < STATES):
            raise OutputError(f"{seeds}:{number}: {line!r}; allowed: a whole number below 2^62")
        ground = draw(tables, int(line))
        ground["scenario"]["name"] = f"{DRAWN}-{number:02d}"
        path = (folder / f"ground-{number:02d}.toml").resolve()
        path.parent.mkdir(parents=True, exist_ok=True)
        write_synced(path, tomli_w.dumps(ground))
        paths.append(str(path))
    of_runs = hashlib.sha256(f"runs {text}".encode()).hexdigest()
    return replace(suite, drawn=DrawnGrounds(tuple(paths), int(of_runs[:12], 16)))
