"""Compare the results of two source trees: tables, summaries, figures and the text of ``compare``.

    python tests/tools/same_results.py TREE_A TREE_B [--python PYTHON_A [PYTHON_B]] [--many] [--out DIR]

For each tree, run the main job (validate, run, plot, sweep, compare, plots); with ``--many`` also the run of each of 40
configurations. Tables are equal if their columns and rows are; metadata does not count, and an empty table counts as
absent. Figures are equal if their pixels are. Print one line per difference; exit with 1 if there is one.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib.image
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

STUDY = """
[study]
name = "main-job"
scenario = "mapping-rendezvous"
strategies = ["remoras", "contract-net", "status-broadcast"]
repeats = 2
seed = 1
metrics = ["mission_time_s", "completed", "coverage_fraction"]
baseline = "remoras"
[[channel]]
name = "perfect"
[[channel]]
name = "bernoulli"
per = [0.3]
"""
MAIN_JOB = {
    "validate": "validate mapping-rendezvous",
    "run": "run mapping-rendezvous --channel bernoulli --per 0.3 --seed 3 --out run",
    "plot": "plot run trajectories roles",
    "sweep": "sweep study.toml --out sweep --jobs 1",
    "compare": "compare sweep",
    "plots": "plot sweep overview ranking",
}
RUN_KEY = ["strategy", "channel", "seed", "repeat"]
"""Columns that identify a run of the sweep in both trees; the column ``key`` depends on the code."""
VARIABLE = {"wall_s", "cpu_s", "host", "worker", "finished_at", "run_id", "key", "code"}
"""Fields that differ between machines or versions of the code."""


def configurations() -> dict[str, str]:
    """Arguments of ``remoras run`` by name: two scenarios, strategies, policies, channels, seeds and settings."""
    mapping, patches = "mapping-rendezvous", "mapping-patches"
    found = {}
    strategies = "remoras", "fixed-partition", "central", "contract-net", "status-broadcast", "cbba", "rendezvous-sync"
    for strategy in strategies:
        for scenario in (mapping, patches):
            found[f"{scenario}-{strategy}"] = f"{scenario} --strategy {strategy} --per 0.4 --seed 7"
    for policy in ("ack", "ack-repeat", "m-ack", "m-ack-repeat", "mps-ack", "mps-ack-repeat"):
        found[f"policy-{policy}"] = f"{mapping} --policy {policy} --per 0.6 --seed 3"
        found[f"patches-{policy}"] = f"{patches} --policy {policy} --per 0.2 --seed 5"
    for strategy in ("remoras", "central", "cbba"):
        bursts = "--channel gilbert-elliott --set channel.per_bad=0.9"
        found[f"bursts-{strategy}"] = f"{mapping} {bursts} --strategy {strategy} --seed 11"
    link = "channel.link=[{sender='AUV01',receiver='AUV00',per=0.9}]"
    blackout = "channel.blackout=[{from_s=400.0,until_s=900.0,vehicle='AUV02'}]"
    return found | {
        "perfect": f"{mapping} --channel perfect",
        "patches-perfect": f"{patches} --channel perfect",
        "matrix": f"{mapping} --channel matrix --per 0.3 --set {link} --seed 2",
        "blackout": f"{mapping} --per 0.2 --set {blackout}",
        "heavy-loss": f"{mapping} --per 0.8 --seed 9",
        "patches-heavy-loss": f"{patches} --per 0.9 --seed 4 --strategy contract-net",
        "spread": f"{patches} --per 0.5 --set uncertainty.speed_spread=0.3 --seed 6",
        "eight": f"{mapping} --per 0.5 --set fleet.size=8 --seed 8",
        "low-battery": f"{patches} --per 0.1 --set vehicle.AUV02.energy_j=200000 --seed 1",
        "ten-copies": f"{patches} --per 0.3 --set fleet.size=10 --strategy central",
        "no-influence": f"{mapping} --per 0.1 --set decision.weight_external=0",
    }


def make(tree: Path, python: str, out: Path, many: bool) -> None:
    """Write the results of ``tree`` into the folder ``out``, with each command's output and exit code."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "study.toml").write_text(STUDY, encoding="utf-8")
    commands = dict(MAIN_JOB)
    if many:
        commands |= {name: f"run {arguments} --out {name}" for name, arguments in configurations().items()}
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    for name, arguments in commands.items():
        command = [python, "-m", "remoras", *arguments.split()]
        done = subprocess.run(command, cwd=out, env=environment, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):
            raise SystemExit(f"{tree}: remoras {arguments}\n{done.stderr}")
        text = f"{done.stdout if name in ('validate', 'compare') else ''}exit code {done.returncode}\n"
        (out / f"{name}.txt").write_text(text, encoding="utf-8")


def differences(a: Path, b: Path) -> Iterator[str]:
    """Differences between two folders of results, one line per file."""
    files = [_files(folder) for folder in (a, b)]
    for name in sorted(files[0] | files[1]):
        if name not in files[0] or name not in files[1]:
            yield f"{name}: only in the {'first' if name in files[0] else 'second'} tree"
        elif name.suffix == ".parquet":
            x, y = (_table(folder, name) for folder in (a, b))
            if x.column_names != y.column_names:
                yield f"{name}: columns {', '.join(sorted(set(x.column_names) ^ set(y.column_names))) or 'reordered'}"
            unlike = [column for column in x.column_names if column in y.column_names and x[column] != y[column]]
            if unlike:
                yield f"{name}: {len(x)} and {len(y)} rows, unequal columns {', '.join(unlike)}"
        elif name.suffix == ".png":
            if not np.array_equal(matplotlib.image.imread(a / name), matplotlib.image.imread(b / name)):
                yield f"{name}: unequal pixels"
        elif name.suffix == ".json":
            old, new = (json.loads((folder / name).read_text(encoding="utf-8")) for folder in (a, b))
            fields = [key for key in {**old, **new} if key not in VARIABLE and old.get(key) != new.get(key)]
            if fields:
                yield f"{name}: unequal fields {', '.join(fields)}"
        elif (a / name).read_text(encoding="utf-8") != (b / name).read_text(encoding="utf-8"):
            yield f"{name}: unequal texts"


def _files(folder: Path) -> set[Path]:
    """Tables with rows, figures, texts and summaries in a folder of results."""
    found = {path for name in ("*.parquet", "*.png", "*.txt", "summary.json") for path in folder.rglob(name)}
    empty = {path for path in found if path.suffix == ".parquet" and not pq.read_metadata(path).num_rows}
    return {path.relative_to(folder) for path in found - empty}


def _table(folder: Path, name: Path) -> pa.Table:
    """Columns that depend on the results only; the rows of a sweep in the order of their runs."""
    table = pq.read_table(folder / name).replace_schema_metadata(None)
    if "key" in table.column_names:
        runs = pq.read_table(folder / name.parts[0] / "runs.parquet", columns=["key", *RUN_KEY]).to_pylist()
        runs.sort(key=lambda row: [str(row[column]) for column in RUN_KEY])
        places = {row["key"]: place for place, row in enumerate(runs)}
        order = np.argsort([places[key] for key in table["key"].to_pylist()], kind="stable")
        table = table.take(order)
    return table.drop_columns([column for column in table.column_names if column in VARIABLE])


def main() -> int:
    """Run and compare; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trees", nargs=2, type=Path, metavar="TREE")
    parser.add_argument("--python", nargs="+", default=[sys.executable], help="interpreter of both or of each tree")
    parser.add_argument("--many", action="store_true", help="also run 40 configurations")
    parser.add_argument("--out", type=Path, help="keep the results in this folder")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        out = (given.out or Path(temporary)).resolve()
        folders = [out / "a", out / "b"]
        pythons = [str(Path(python).absolute()) for python in (given.python * 2)[:2]]
        with ThreadPoolExecutor() as pool:
            trees = [tree.resolve() for tree in given.trees]
            list(pool.map(make, trees, pythons, folders, [given.many] * 2))
        found = list(differences(*folders))
        n_files = len(_files(folders[0]) | _files(folders[1]))
    print(*found, f"{n_files} tables, figures, texts and summaries compared, {len(found)} differences", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
