"""Compare the results of two source trees: tables, summaries, figures and the text of ``compare``.

    python tests/tools/same_results.py TREE_A TREE_B [--python PYTHON_A [PYTHON_B]] [--out DIR]

For each tree, run the main job (validate, run, plot, sweep, compare, plots). Tables are equal if their columns and rows
are; metadata does not count, and an empty table counts as absent. Figures are equal if their pixels are. Print one line
per difference; exit with 1 if there is one.
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


def make(tree: Path, python: str, out: Path) -> None:
    """Write the results of ``tree`` into the folder ``out``, with each command's output and exit code."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "study.toml").write_text(STUDY, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    for name, arguments in MAIN_JOB.items():
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
    parser.add_argument("--out", type=Path, help="keep the results in this folder")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        out = (given.out or Path(temporary)).resolve()
        folders = [out / "a", out / "b"]
        pythons = [str(Path(python).absolute()) for python in (given.python * 2)[:2]]
        with ThreadPoolExecutor() as pool:
            trees = [tree.resolve() for tree in given.trees]
            list(pool.map(make, trees, pythons, folders))
        found = list(differences(*folders))
        n_files = len(_files(folders[0]) | _files(folders[1]))
    print(*found, f"{n_files} tables, figures, texts and summaries compared, {len(found)} differences", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
