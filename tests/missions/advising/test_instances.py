"""Instances: each is drawn by its number, its traits follow from its text, and its runs are made as a study's are."""

from pathlib import Path

import pytest
import tomli_w

from missions.advising import running
from missions.advising.experience import experience_in, read_experience
from missions.advising.instances import LARGE, drawn_scenario
from missions.advising.traits import TRAITS, traits_of
from missions.errors import ConfigurationError
from missions.files import shipped
from missions.runs.setup import resolved
from missions.scenarios import load

SHAPES = {"bernoulli", "gilbert-elliott", "matrix", "network"}


def traits(name: str, *settings: str) -> dict[str, float]:
    """Traits of a scenario by name."""
    setup = resolved(load(name, [("--set", setting) for setting in settings]))
    return dict(zip([trait.name for trait in TRAITS], traits_of(setup), strict=True))


def test_an_instance_follows_from_its_number() -> None:
    assert drawn_scenario(17) == drawn_scenario(17)
    assert drawn_scenario(17) != drawn_scenario(18)
    assert drawn_scenario(17, seed=1) != drawn_scenario(17)


def test_shipped_traits_are_those_of_the_drawn_scenarios(tmp_path: Path) -> None:
    """So anybody can make an instance again of which advice speaks; all of them are scenarios that can be run."""
    shapes, sizes = set(), set()
    for instance in read_experience().instances:
        path = tmp_path / f"{instance.number}.toml"
        path.write_text(tomli_w.dumps(drawn_scenario(instance.number)))
        setup = resolved(load(str(path)))
        assert traits_of(setup) == instance.traits
        shapes.add(setup.scenario.channel.name)
        sizes.add(len(setup.database))
    assert shapes == SHAPES
    assert min(sizes) == 3
    assert LARGE[0] < max(sizes) <= LARGE[1] + 1


def test_traits_are_what_the_scenario_says() -> None:
    """``mapping-patches``: three vehicles for 13 patches, a frame of 4 slots of 1.106 s and 0.667 s of guard."""
    found = traits("mapping-patches", "channel.per=0.5")
    assert (found["workers"], found["vehicles"], found["jobs"], found["room"]) == (3.0, 4.0, 13.0, 1.0)
    assert found["frame_s"] == pytest.approx(4 * (64 * 8 / 463.0 + 1000.0 / 1500.0), abs=0.01)
    assert (found["loss"], found["loss_spread"], found["burst_slots"]) == (0.5, 0.0, 1.0)
    assert found["news_s"] == pytest.approx(2.0 * found["frame_s"], rel=1e-4)
    assert traits("mapping-corridor")["room"] == 2.0


@pytest.mark.parametrize(
    ("settings", "changed"),
    [
        (["finds.number=4"], {"found": 4.0}),
        (["uncertainty.speed_spread=0.3"], {"speed_spread": 0.3}),
        (["channel.name=network"], {"loss": 0.42, "loss_spread": None, "news_s": None}),
        (
            [
                "channel.name=gilbert-elliott", "channel.p_good_to_bad=0.05", "channel.p_bad_to_good=0.05",
                "channel.per_good=0.0", "channel.per_bad=1.0",
            ],
            {"loss": 0.5, "burst_slots": 20.0, "news_s": None},
        ),
        (["strategy.name=cbba"], {}),
    ],
)  # fmt: skip
def test_a_setting_changes_the_traits_that_it_is_about(settings: list[str], changed: dict[str, float | None]) -> None:
    plain, other = traits("mapping-patches"), traits("mapping-patches", *settings)
    assert {name for name in plain if plain[name] != other[name]} == set(changed)
    assert all(other[name] == pytest.approx(value, abs=0.01) for name, value in changed.items() if value is not None)


def test_a_vehicle_that_may_be_lost_takes_its_time_for_work(tmp_path: Path) -> None:
    path = tmp_path / "lost.toml"
    fault = '[[fault]]\nvehicle = "head of Operational"\nkind = "lost"\nat_s = {}\n'
    text = shipped()["mapping-patches"].read_text()
    shares = []
    for at_s in ("[0.0, 0.0]", "[300.0, 900.0]", "7000.0"):
        path.write_text(f"{text}\n{fault.format(at_s)}")
        found = traits(str(path))
        assert (found["lost"], found["head_lost"]) == (1.0, 1.0)
        shares.append(found["work_lost"])
    assert shares[0] == pytest.approx(1.0 / 3.0, abs=1e-4)
    assert shares[0] > shares[1] > shares[2] == 0.0


def test_a_mission_without_jobs_to_divide_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"scenario.mission = .*advice is about jobs that a group divides"):
        traits("arrows-archaeology")


def test_runs_are_made_once_and_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two strategies on the first small instance; more repeats add to what is there."""
    monkeypatch.setattr(running, "STRATEGIES", ("central", "fixed-partition"))
    monkeypatch.setattr("missions.advising.experience.STRATEGIES", ("central", "fixed-partition"))
    running.make(tmp_path, 1, [((15,), 1)])
    one = experience_in(tmp_path)
    ledger = (tmp_path / "instance-015" / "ledger.jsonl").read_text()
    running.make(tmp_path, 1, [((15,), 2)])
    two = experience_in(tmp_path)
    running.make(tmp_path, 1, [((15,), 1)])
    assert experience_in(tmp_path) == two
    assert (tmp_path / "instance-015" / "ledger.jsonl").read_text().startswith(ledger)
    assert [len(times) for times in two.instances[0].times_s] == [2, 2]
    assert [times[0] for times in two.instances[0].times_s] == [times[0] for times in one.instances[0].times_s]
