"""Output files of figures: formats, metadata, errors."""

from __future__ import annotations

import csv
import hashlib
import html
import io
from collections.abc import Container, Iterable, Mapping, Sequence
from contextlib import ExitStack
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from missions.disk import check_folder, drafted
from missions.figure import RunResults

if TYPE_CHECKING:
    from missions.sweeps.folder import SweepResults


class VisualisationError(Exception):
    """Base class of the errors of this package."""


class DrawingError(VisualisationError, ValueError):
    """Invalid figure request or failed output."""


class ExportError(VisualisationError, ValueError):
    """Export impossible for these results, or failed output."""


def unknown(
    kind: str, name: str, known: Iterable[str], error: type[VisualisationError] = DrawingError
) -> VisualisationError:
    """Return the error for an unknown name: value given, values allowed, nearest."""
    names = list(known)
    near = get_close_matches(name, names, n=1, cutoff=0.0)
    return error(f"unknown {kind} {name!r}; known: {', '.join(names)}; nearest: {near[0]!r}")


def check_kinds(kinds: Iterable[str], known: Sequence[str], what: str, others: Container[str], elsewhere: str) -> None:
    """Raise DrawingError for an unknown kind of figure; ``elsewhere`` describes results that have ``others``."""
    for kind in kinds:
        if kind in others:
            raise DrawingError(f"{kind!r} is a figure of {elsewhere}; known: {', '.join(known)}")
        if kind not in known:
            raise unknown(what, kind, known)


KINDS: Mapping[str, tuple[str, ...]] = {
    "trajectories": ("trajectories",),
    "roles": ("roles",),
    "organisation": ("organisation",),
    "satisfaction": ("satisfaction", "roles"),
    "motivation": ("decisions",),
    "htn": ("plans",),
    "knowledge": ("packets", "knowledge"),
    "delivery": ("packets",),
    "tdma": ("packets",),
    "links": ("links",),
}
SWEEP_KINDS = ("differences", "trade-off", "ranking", "overview")
"""Kinds of sweep figures, besides one chart per metric."""
FACTORIAL_KINDS = ("effects",)  # kinds of figures of a factorial study; by default they replace all others


NAME = "remoras"


def about_run(results: RunResults) -> dict[str, str]:
    """Return the provenance of a run: version, run key, seed, scenario, strategy, policy, channel."""
    summary, manifest = results.summary, results.manifest
    facts: dict[str, Any] = {
        "version": f"{NAME} {manifest['version']}",
        "run": manifest.get("run_id"),
        **{name: summary.get(name) for name in ("seed", "scenario", "strategy", "policy", "channel", "per")},
    }
    return {name: str(value) for name, value in facts.items() if value is not None}


def of_sweep(results: SweepResults) -> dict[str, str]:
    """Return the provenance of a sweep: version, digest of the study, master seed, name."""
    schedule = results.schedule
    digest = hashlib.sha256(
        " ".join([schedule.version, *(label.digest for label in schedule.labels)]).encode()
    ).hexdigest()[:20]
    study = results.file.study
    return {"version": f"{NAME} {schedule.version}", "study": digest, "seed": str(study.seed), "name": study.name}


FORMATS = ("png", "svg", "pdf")
LEAST_WIDTH_IN, MOST_WIDTH_IN = 3.0, 20.0


class Drawn(NamedTuple):
    """Files written, in order of figures, and notes for the user."""

    files: list[Path]
    notes: list[str]


def check_format(format: str) -> None:
    """Raise DrawingError unless the format is one of ``FORMATS``."""
    if format not in FORMATS:
        raise unknown("format", format, FORMATS)


def check_width(width_in: float | None) -> None:
    """Raise DrawingError unless the width is None (default) or within the limits."""
    if width_in is not None and not LEAST_WIDTH_IN <= width_in <= MOST_WIDTH_IN:
        raise DrawingError(
            f"width {width_in:g} in: allowed are {LEAST_WIDTH_IN:g} to {MOST_WIDTH_IN:g} inches; a column of a "
            "paper has 3.5, a page 7.2"
        )


def as_csv(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> bytes:
    """Encode a table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([head, *rows])
    return text.getvalue().encode()


def html_page(title: str, policy: str, head: str, body: str) -> str:
    """Return a self-contained page of HTML; ``policy`` is its content security policy, ``head`` has its styles."""
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<link rel="icon" href="data:,">
{head}
</head>
<body>
{body}
</body>
</html>
"""


def write_folder(folder: Path, contents: Iterable[tuple[str, bytes]]) -> list[Path]:
    """Write files into a folder, created if missing.

    Raises OutputError for a file in its place, DrawingError if a write fails; existing files are then unchanged.
    """
    check_folder(folder)
    path, paths = folder, list[Path]()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # The drafts get their names when the stack ends: a full disk leaves the existing files as they are.
        with ExitStack() as drafts:
            for name, content in contents:
                path = folder / name
                drafts.enter_context(drafted(path)).write_bytes(content)
                paths.append(path)
    except OSError as error:
        raise DrawingError(f"{path}: cannot be written: {error.strerror}") from None
    return paths
