"""Short runs whose every bit is written down: ``digests.toml`` says what each gave, a test that it still does.

    python tests/reference/reference_runs.py write            # write digests.toml anew
    python tests/reference/reference_runs.py check [JOBS [RUN ...]]     # compare; exit code 1 if a run differs

A digest covers the columns and rows of all non-empty tables, every number in full, and the summary without the reason
of a failure, before a file rounds them. It is the same on every machine, under every Python, NumPy and library of
functions, and for any number of workers. An empty table does not change it. A commit that changes a digest on purpose
writes the file anew and names the changed runs in CHANGELOG.md.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from missions.runs.results import summary
from missions.runs.run import Run, run
from missions.scenarios import load
from missions.sweeps.pool import SupervisedPool
from remoras.recorder import Table

FILE = Path(__file__).with_name("digests.toml")
BLACKOUT = "channel.blackout=[{from_s=100.0, until_s=200.0, vehicle='AUV02'}]"
BURSTS = "channel.name=gilbert-elliott"
LINK = "channel.link=[{sender='AUV01', receiver='AUV00', per=0.9}]"
FAULTS = "fault=[{vehicle='any', kind='lost', rate_per_h=4.0}, {vehicle='AUV01', kind='slow', factor=0.5, at_s=50.0}]"
WATER = "current={east_mps=0.2, north_mps=-0.1, tide_period_h=0.3}"

RUNS: dict[str, tuple[str, float, int, tuple[str, ...]]] = {
    "remoras": ("mapping-rendezvous", 900.0, 7, ("channel.per=0.4",)),
    "fixed partition": ("mapping-rendezvous", 900.0, 2, ("strategy.name=fixed-partition", WATER)),
    "central, bursts": (
        "mapping-rendezvous", 700.0, 3,
        ("strategy.name=central", "communication.policy=ack-repeat", BURSTS, "channel.per_bad=0.9"),
    ),
    "contract net, blackout": (
        "mapping-patches", 500.0, 4,
        ("strategy.name=contract-net", "communication.policy=m-ack", "channel.per=0.2", BLACKOUT),
    ),
    "status broadcast": (
        "mapping-patches", 500.0, 5,
        ("strategy.name=status-broadcast", "communication.policy=m-ack-repeat", "channel.per=0.4"),
    ),
    "cbba": ("mapping-patches", 400.0, 6, ("strategy.name=cbba", "communication.policy=mps-ack", "channel.per=0.3")),
    "cbba, plain": ("mapping-patches", 400.0, 24, ("strategy.name=cbba-plain", "channel.per=0.3")),
    "rendezvous sync": (
        "mapping-rendezvous", 900.0, 8,
        ("strategy.name=rendezvous-sync", "communication.policy=mps-ack-repeat", "channel.per=0.5"),
    ),
    "plan and dispatch": (
        "mapping-three-teams", 300.0, 9,
        ("strategy.name=plan-and-dispatch", "communication.policy=ack-repeat", "channel.per=0.3"),
    ),
    "planned": (
        "mapping-rendezvous", 700.0, 10,
        ("strategy.name=remoras-planned", "communication.policy=m-ack-repeat", "channel.per=0.3"),
    ),
    "oracle": ("mapping-corridor", 400.0, 11, ("strategy.name=oracle",)),
    "matrix": ("mapping-rendezvous", 700.0, 12, ("channel.name=matrix", "channel.per=0.3", LINK)),
    "perfect, faults": ("mapping-rendezvous", 900.0, 13, ("channel.name=perfect", FAULTS)),
    "day": ("pandora-day", 900.0, 14, ("current.surge=[]", "fault=[]")),
    "finds": ("mapping-inspection", 800.0, 15, ("communication.policy=mps-ack", "channel.per=0.4")),
    "nine teams": ("mapping-nine-teams", 200.0, 16, ("channel.per=0.3",)),
    "nine, acoustic": ("mapping-nine-flat", 200.0, 17, ("channel.name=acoustic", "channel.source_level_db=170.0")),
    "objects": ("mapping-objects", 700.0, 18, ("channel.per=0.2",)),
    "pandora": ("pandora-inspection", 3100.0, 19, ()),
    "archaeology": ("arrows-archaeology", 1000.0, 20, ()),
    "trident": ("trident-intervention", 1500.0, 21, ("channel.per=0.2",)),
    "recovery": ("recovery-field", 900.0, 22, ()),
    "ferry": ("ferry-passage", 500.0, 23, ()),
    "escort": ("escort-lines", 600.0, 25, ()),
    "resupply": ("resupply-field", 1000.0, 26, ()),
    "minehunting": ("minehunting-contacts", 900.0, 24, ()),
}  # fmt: skip
"""By name: scenario, how long it lasts (s), seed, and what else is set."""


def digest(name: str) -> str:
    """Digest of a run of ``RUNS``."""
    return digest_of(made(name))


def made(name: str) -> Run:
    """Make a run of ``RUNS``."""
    shipped, duration_s, seed, given = RUNS[name]
    settings = (f"scenario.duration_s={duration_s}", *given)
    return run(load(shipped, [("--set", one) for one in settings]), seed)


def digest_of(finished: Run) -> str:
    """Digest of the summary, the exact distance, and the columns and rows of the non-empty tables, sorted by name."""
    rows = {table: _rows(table, finished.recorder.rows(table.name)) for table in finished.recorder.tables.values()}
    tables = {table.name: [table.column_names, rows[table]] for table in rows if rows[table]}
    figures = {name: value for name, value in summary(finished).items() if name != "reason"}
    content = _exact([figures, finished.distance_m, tables])
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:20]


def _rows(table: Table, rows: Iterable[tuple[Any, ...]]) -> list[list[Any]]:
    """Rows of a table; each number has the type that its column declares."""
    kinds = [_TYPES.get(column.kind, lambda value: value) for column in table.columns]
    return [[None if value is None else kind(value) for kind, value in zip(kinds, row, strict=True)] for row in rows]


_TYPES: dict[str, Callable[[Any], Any]] = {
    "float": float, "int": int, "floats": lambda values: [*map(float, values)],
    "ints": lambda values: [*map(int, values)],
}  # fmt: skip


def _exact(value: Any) -> Any:
    """The value with every float as hexadecimal digits, and with NumPy numbers as those of Python."""
    if isinstance(value, Mapping):
        return {key: _exact(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_exact(one) for one in value]
    if isinstance(value, float):
        return value.hex()
    return value if value is None or isinstance(value, str | bool | int) else _exact(value.item())


def digests(n_workers: int = 1, names: Iterable[str] = tuple(RUNS)) -> dict[str, str]:
    """Digests of runs, computed by so many processes."""
    with SupervisedPool(n_workers, "missions.runs.run") as pool:
        coming = {name: pool.submit(digest, name) for name in names}
        return {name: one.result() for name, one in coming.items()}


def written() -> dict[str, str]:
    """Recorded digests of the file."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def main(arguments: list[str]) -> int:
    """Write the file, or compare."""
    if arguments[:1] == ["write"]:
        lines = (f'"{name}" = "{one}"\n' for name, one in digests(2).items())
        FILE.write_text(
            f"# Written by {Path(__file__).name}, which says what it is.\n{''.join(lines)}", encoding="utf-8"
        )
        return 0
    if arguments[:1] != ["check"]:
        print(__doc__)
        return 2
    before, now = written(), digests(int((arguments[1:] or ["1"])[0]), arguments[2:] or tuple(RUNS))
    changed = [name for name in now if now[name] != before.get(name)]
    print(f"{len(now) - len(changed)} of {len(now)} runs as written", *changed, sep="\n    ")
    return 1 if changed else 0


if __name__ == "__main__":
    sys.path.insert(0, str(FILE.parent.parent))
    from reference import reference_runs  # workers find functions by names that they can import

    sys.exit(reference_runs.main(sys.argv[1:]))
