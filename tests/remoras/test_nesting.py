"""Group hierarchy: supervision, order of rendezvous, and groups without common members."""

from remoras.group_hierarchy import apart, height, meets_after, supervised_by, supervisors_of
from remoras.organisation import Group


def group(name: str, within: str | None = None, mission: str | None = None, rally: str | None = "point") -> Group:
    return Group(name, (), rally, mission, within=within)


FLAT = (group("HQ", mission="Supervision"), group("Left"), group("Right"), group("Quiet", rally=None))
DEEP = (
    group("Fleet", mission="Supervision"), group("Squadron", "Fleet"), group("West", "Squadron"),
    group("East", "Squadron"), group("Reserve", "Fleet"),
)  # fmt: skip


def test_in_a_flat_organisation_the_group_with_a_mission_supervises_the_others() -> None:
    assert supervisors_of(FLAT) == {"HQ": (), "Left": ("HQ",), "Right": ("HQ",), "Quiet": ("HQ",)}
    assert supervised_by(FLAT)["HQ"] == ("Left", "Right", "Quiet")
    assert meets_after(FLAT) == {"HQ": ("Left", "Right"), "Left": (), "Right": (), "Quiet": ()}
    assert apart(FLAT) == dict.fromkeys(("HQ", "Left", "Right", "Quiet"), frozenset())


def test_a_subgroup_is_supervised_by_the_group_that_it_is_within() -> None:
    assert supervisors_of(DEEP) == {
        "Fleet": (), "Squadron": ("Fleet",), "West": ("Squadron",), "East": ("Squadron",), "Reserve": ("Fleet",),
    }  # fmt: skip
    assert supervised_by(DEEP)["Squadron"] == ("West", "East")


def test_rendezvous_proceed_from_the_lowest_level_up() -> None:
    before = meets_after(DEEP)
    assert before == {
        "Fleet": ("Squadron", "West", "East", "Reserve"), "Squadron": ("West", "East"), "West": (), "East": (),
        "Reserve": (),
    }  # fmt: skip
    assert [height(one.name, before) for one in DEEP] == [2, 1, 0, 0, 0]


def test_groups_on_separate_branches_share_no_members() -> None:
    found = apart(DEEP)
    assert found["West"] == {"East", "Reserve"}
    assert found["Squadron"] == {"Reserve"}
    assert found["Fleet"] == frozenset()
