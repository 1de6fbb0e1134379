"""Needs stated by vehicles, and silent vehicles: from the scenario to the knowledge of the others."""

from collections.abc import Sequence
from pathlib import Path

from missions.runs.assembly import assemble
from missions.runs.results import summary
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load
from remoras.fleet.fleet import Fleet

SHIPPED = Path(__file__).parents[2] / "missions" / "mapping" / "rendezvous.toml"
END_S = 200.0
BEGINS_S = 100.0


def scenario(folder: Path, tables: str, *settings: str, listed: Sequence[str] = ()) -> Scenario:
    """The shipped scenario, cut short, with further tables; ``listed`` attributes are no longer needed by all."""
    text = SHIPPED.read_text(encoding="utf-8")
    for name in listed:
        text = "\n".join(line for line in text.splitlines() if not line.startswith(f"{name} ="))
    path = folder / "scenario.toml"
    path.write_text(f"{text}\n{tables}\n", encoding="utf-8")
    return load(str(path), [("--set", one) for one in (f"scenario.duration_s={END_S}", *settings)])


def fleet_of(given: Scenario) -> Fleet:
    fleet = assemble(resolved(given), seed=3)
    fleet.run()
    return fleet


def cells(fleet: Fleet, knower: int, before_s: float = END_S) -> int:
    """How many cells that others mapped before a time a vehicle knows of."""
    model = fleet.vehicles[knower].beliefs.model
    attribute = model.tbox.attribute_named("mappedCell").uid
    areas = [uid for uid in model.instance_uids() if model.history(uid, attribute)]
    known = [one for uid in areas for one in model.history(uid, attribute)]
    return sum(one.time_s < before_s and one.origin != knower for one in known)


NEED = '[[need]]\nattribute = "mappedCell"\nvehicle = "ASV00"\npriority = 5\n'


def test_need_stated_during_the_mission_delivers_earlier_observations(tmp_path: Path) -> None:
    """Cells that were mapped before anybody needed them go out once ASV00 has said that it needs them; without the
    need they stay where they were observed. Vehicle 1 does not keep back what it overhears."""
    needed = fleet_of(scenario(tmp_path, NEED + f"from_s = {BEGINS_S}", listed=["mappedCell"]))
    never = fleet_of(scenario(tmp_path, NEED + f"from_s = {END_S - 1.0}", listed=["mappedCell"]))
    assert cells(needed, 0, BEGINS_S) > 0
    assert cells(never, 0) == 0
    told = [row for row in needed.recorder.items if row[4] == "need 1 of ASV00"]
    assert {(row[1], row[7]) for row in told} == {("ASV00", "told")}
    before = [row for row in needed.recorder.packets if row[1] < BEGINS_S]
    mapped = {row[0] for row in needed.recorder.items if row[5] == "mappedCell"}
    assert mapped
    assert not any(mapped.intersection(row[10]) for row in before)


def test_summary_counts_expired_items_only_for_needs_with_a_limit(tmp_path: Path) -> None:
    made = run(scenario(tmp_path, NEED + "ttl_s = 15.0", "channel.per=0.8", listed=["mappedCell"]), 3)
    lost = [row for row in made.recorder.rows("deliveries") if row[4] in {"time to live", "overflow"}]
    assert summary(made)["n_expired"] == len(lost) > 0
    assert "n_expired" not in summary(run(scenario(tmp_path, NEED, listed=["mappedCell"]), 3))
