"""The how-tos work as printed: their files are written, their commands run, and have the effect that the page claims.

A block whose first line is ``# name.ext`` is that file, and so is an example that the page links to; a Python block
without a name is run as a script; a line of a ``sh`` block is a command. Blocks are taken in the order of the page.
"""

import itertools
import json
import math
import re
import shlex
import shutil
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from test_documents import answered, called
from typer.testing import CliRunner

from missions.scenarios import shipped
from missions.sweeps.study import load_study
from remoras import api
from remoras.cli import app
from remoras.functional import guidance
from remoras.motion.avoidance import SEPARATION_M

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "howto").glob("*.md"))


def blocks(page: Path) -> Iterator[tuple[str, str]]:
    """Language and text of the fenced blocks of a page that have a language, in order."""
    yield from re.findall(r"^```(\w+)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def execute(page: Path, folder: Path) -> dict[str, str]:
    """Execute the commands of a page in a folder; return their outputs by line."""
    said: dict[str, str] = {}
    for example in re.findall(r"\.\./examples/([\w-]+\.\w+)", page.read_text(encoding="utf-8")):
        shutil.copy(ROOT / "docs" / "examples" / example, folder)
    for number, (language, text) in enumerate(blocks(page)):
        name = re.match(r"# (\S+\.\w+)\n", text)
        if name is not None:
            (folder / name[1]).write_text(text, encoding="utf-8")
        elif language == "python":
            with redirect_stdout(StringIO()) as printed:
                exec(compile(text, f"{page.name}, block {number}", "exec"), {"__name__": "__main__"})
            said[text] = printed.getvalue()
        elif language == "sh":
            for line in text.splitlines():
                command, _, target = line.partition(" > ")
                program, *arguments = shlex.split(command)
                said[line] = answered(command) if program == "remoras" else called(arguments, folder)
                if target:
                    (folder / target).write_text(said[line], encoding="utf-8")
    return said


Claim = Callable[[Path, dict[str, str]], None]
CLAIMS: dict[str, list[Claim]] = defaultdict(list)
"""What is so after a page was executed, of its folder and what its commands printed, by the name of the page."""


def claimed(page: str) -> Callable[[Claim], Claim]:
    """Add what a page claims."""

    def kept(claim: Claim) -> Claim:
        CLAIMS[page].append(claim)
        return claim

    return kept


def summary(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return found


def rows(folder: Path, table: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = pq.read_table(folder / f"{table}.parquet").to_pylist()
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_printed_toml_fragments_load(page: Path, tmp_path: Path) -> None:
    """A TOML block without a name takes the place of a table of the shipped scenario, or is a study."""
    shipped_text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    for number, (language, text) in enumerate(blocks(page)):
        if language != "toml" or re.match(r"# \S+\.toml\n", text):
            continue
        file = tmp_path / f"{number}.toml"
        if "[study]" in text:
            file.write_text(text, encoding="utf-8")
            assert load_study(str(file)).configurations
            continue
        table = re.escape(text.splitlines()[0])
        changed, n = re.subn(rf"^{table}\n.*?(?=^\[)", lambda _, own=text: f"{own}\n", shipped_text, flags=re.M | re.S)
        assert n == 1, text
        file.write_text(changed, encoding="utf-8")
        done = CliRunner().invoke(app, ["validate", str(file)])
        assert done.exit_code == 0, done.output


def test_the_index_names_every_page() -> None:
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    assert {f"howto/{page.stem}" for page in PAGES} == set(re.findall(r"^howto/\w+$", index, re.M))


# What the pages claim ---------------------------------------------------------------------------


@claimed("components")
def an_external_sensor_writes_its_table(folder: Path, said: dict[str, str]) -> None:
    """The warm patch is 4 degrees, the depth of 20 m takes 1: readings lie within 11 and 15."""
    readings = rows(folder / "warm", "thermometer")
    assert {row["vehicle"] for row in readings} == {"AUV01"}
    assert all(11.0 <= row["reading"] <= 15.0 for row in readings)
    assert min(b["time_s"] - a["time_s"] for a, b in itertools.pairwise(readings)) >= 5.0


@claimed("components")
def an_external_metric_is_compared_and_ranked(folder: Path, said: dict[str, str]) -> None:
    asked = said["remoras compare one --metric closest.py:CLOSEST"]
    assert float(asked.split()[-1]) == summary(folder / "two")["closest_m"] > 0.0
    assert "closest_m" in said["remoras compare several"]
    assert "1 is the highest" in (folder / "several" / "ranking-closest_m.txt").read_text(encoding="utf-8")


@claimed("components")
def an_external_figure_is_drawn(folder: Path, said: dict[str, str]) -> None:
    caption = (folder / "one" / "speed.txt").read_text(encoding="utf-8")
    assert "Speed over mission time" in caption
    assert (folder / "one" / "speed.svg").stat().st_size > 5000


@claimed("channel")
def links_of_an_external_channel_lose_by_range(folder: Path, said: dict[str, str]) -> None:
    assert summary(folder / "clear")["delivery_ratio"] == 1.0
    assert summary(folder / "faded")["delivery_ratio"] < 0.95


@claimed("strategy")
def an_external_strategy_conforms(folder: Path, said: dict[str, str]) -> None:
    assert summary(folder / "mine")["strategy"] == "nearest:NEAREST"
    assert "1 passed" in said["python -m pytest -q test_nearest.py"]


@claimed("extensions")
def an_external_policy_conforms(folder: Path, said: dict[str, str]) -> None:
    assert summary(folder / "mine")["policy"] == "alternate_acks:SPARSE"
    assert any("ok" in text for line, text in said.items() if "remoras check" in line)


@claimed("components")
def an_external_behaviour_decides_where_vehicles_wait(folder: Path, said: dict[str, str]) -> None:
    """On a circle of 12 m around the rally point at (450, 450), until the group is together; then they form up."""
    (gathered,) = [one["time_s"] for one in summary(folder / "ring")["milestones"] if one["group"] == "Operational"]
    tracks = rows(folder / "ring", "trajectories")
    waiting = {row["vehicle"]: (row["x_m"], row["y_m"]) for row in tracks if row["time_s"] <= gathered}
    for vehicle in ("AUV01", "AUV02"):
        assert 10.0 <= math.dist(waiting[vehicle], (450.0, 450.0)) <= 15.0


@claimed("knowledge")
def knowledge_query_gives_observers_and_reception_times(folder: Path, said: dict[str, str]) -> None:
    """One query gives what the tables of the run say: cells from ``items``, receptions from ``knowledge``."""
    assert "operational rally" in next(text for line, text in said.items() if "gatheredAt" in line)
    answer = json.loads((folder / "cells.json").read_text(encoding="utf-8"))
    cells = {row["uid"]: row for row in rows(folder / "lossy", "items") if row["attribute"] == "mappedCell"}
    observed = {(row["subject"], int(float(row["value"])), row["origin"], row["time_s"]) for row in cells.values()}
    assert {(one["area"], one["cell"], one["observer"], one["observed_s"]) for one in answer} == observed
    received = {
        (row["vehicle"], cells[row["item"]]["subject"], cells[row["item"]]["time_s"], row["time_s"])
        for row in rows(folder / "lossy", "knowledge")
        if row["event"] == "received" and row["item"] in cells
    }
    got = {(one["vehicle"], one["area"], one["observed_s"], one["received_s"]) for one in answer if one["received_s"]}
    assert got == received
    assert all((one["received_s"] is None) == (one["vehicle"] == one["observer"]) for one in answer)
    assert {one["sender"] for one in answer} >= {"AUV00", "AUV01", "AUV02"}


@claimed("sea")
def faults_of_a_scenario_are_rows_of_the_run(folder: Path, said: dict[str, str]) -> None:
    found = [(row["time_s"], row["vehicle"], row["kind"]) for row in rows(folder / "faulty", "faults")]
    assert (300.0, "AUV01", "lost") in found
    assert [row[1] for row in found if row[2] == "mute"] == ["AUV00", "AUV00"]  # its beginning and its end


# The mission from outside -------------------------------------------------------------------------


@claimed("mission")
def an_external_mission_has_its_own_results(folder: Path, said: dict[str, str]) -> None:
    found = summary(folder / "first")
    assert found["completed"]
    assert found["serviced_fraction"] == 1.0
    assert "coverage_fraction" not in found
    served_s = {row["job"]: row["time_s"] for row in rows(folder / "first", "jobs")}
    assert served_s["north"] >= served_s["mother"] + 40.0  # it comes after, and takes 40 s
    assert "services" in (folder / "first" / "services.txt").name
    (seen,) = rows(folder / "first", "sightings")
    answer = next(text for line, text in said.items() if line.startswith("remoras query first"))
    assert all(vehicle in answer for vehicle in ("AUV00", "AUV01", "AUV02"))
    assert f"POINT ({seen['x_m']} {seen['y_m']})" in answer
    assert "mean_service_s" in said["remoras compare several --metric mean_service_s"]
    caption = (folder / "several" / "ranking-mean_service_s.txt").read_text(encoding="utf-8")
    assert "1 is the lowest" in caption


@claimed("mission")
def all_vehicles_know_of_the_plume_despite_losses(folder: Path, said: dict[str, str]) -> None:
    found = summary(folder / "plume")
    assert found["completed"]
    assert found["n_edges"] == len(rows(folder / "plume", "edges")) == 26
    assert found["edge_error_m"] == pytest.approx(0.6, abs=0.05)
    answer = next(text for line, text in said.items() if line.startswith("remoras query plume"))
    assert [answer.count(vehicle) for vehicle in ("AUV00", "AUV01", "AUV02")] == [26, 26, 26]
    assert said["python blind.py"].split() == ["26", "3"]  # vehicles that do not heed what they see lose the plume


HEAD_ON: dict[str, Any] = {
    "vehicle.AUV01.start_m": [-100.0, 0.0], "vehicle.AUV02.start_m": [100.0, 0.0],
    "vehicle.AUV01.playable_roles": ["Hand", "Servicereast"], "vehicle.AUV02.playable_roles": ["Hand", "Servicerwest"],
}  # fmt: skip
"""As the page has it: each has to go to where the other is, at one depth."""


def nearest_m(found: list[dict[str, Any]]) -> float:
    """Least distance of AUV01 and AUV02 at any time."""
    one, other = ([(row["x_m"], row["y_m"]) for row in found if row["vehicle"] == name] for name in ("AUV01", "AUV02"))
    return min(itertools.starmap(math.dist, zip(one, other, strict=True)))


@claimed("mission")
def vital_behaviours_keep_two_vehicles_apart(folder: Path, said: dict[str, str]) -> None:
    assert nearest_m(rows(folder / "headon", "trajectories")) >= SEPARATION_M
    with pytest.MonkeyPatch.context() as without:
        without.setattr(guidance, "clear_velocity", lambda *_: None)
        run = api.run("buoys.toml", seed=1, set=HEAD_ON)
    assert nearest_m(run.table("trajectories").to_dict("records")) < SEPARATION_M


@claimed("mission")
def a_vehicle_low_on_energy_goes_home_by_a_vital_behaviour(folder: Path, said: dict[str, str]) -> None:
    last = {row["vehicle"]: row for row in rows(folder / "weak", "trajectories")}["AUV01"]
    assert math.dist((last["x_m"], last["y_m"]), (-20.0, 0.0)) <= 1.5
    left = {row["role"] for row in rows(folder / "weak", "roles") if row["event"] == "left"}
    assert "Hand" in left
    assert summary(folder / "weak")["serviced_fraction"] == 1.0


@pytest.mark.parametrize("page", [page.stem for page in PAGES])
def test_a_page_works_as_printed_and_has_the_effect_that_it_claims(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    said = execute(ROOT / "docs" / "howto" / f"{page}.md", tmp_path)
    for claim in CLAIMS[page]:
        claim(tmp_path, said)
    for name, module in list(sys.modules.items()):  # else other tests would meet modules of these names
        if str(getattr(module, "__file__", None)).startswith(str(tmp_path)):
            del sys.modules[name]
