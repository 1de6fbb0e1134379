"""Sites, loads, lines and contacts that cannot be are told with file, line, key, value and what is allowed."""

import re
from pathlib import Path
from typing import Any

import pytest
from varied import Varied

from missions.errors import ConfigurationError
from missions.scenarios import load
from missions.scenarios.parts import mission_class

ESCORT, FERRY = Varied("escort-lines", "lines.toml"), Varied("ferry-passage", "reef.toml")
HUNT, RECOVERY = Varied("minehunting-contacts", "contacts.toml"), Varied("recovery-field", "field.toml")
RESUPPLY = Varied("resupply-field", "field.toml")
HOLE_2 = r"boring.hole 2.position_m = \[-240.0, 90.0\]: more than 4 m from hole 1: a drill is at one hole"
SHORT_LINE = r"line.line 1.to_m = \[-320, -95\]: the line is too short; allowed: 10 m or more"


@pytest.mark.parametrize(("of", "table", "change", "says"), [
    (ESCORT, "line", {"name": "line 2"}, 'line.line 2.name = "line 2": used 2 times'),
    (ESCORT, "line", {"to_m": [900.0, 0.0]}, r"line.line 1.to_m = \[900.0, 0.0\]: outside the world"),
    (ESCORT, "line", {"to_m": [-320.0, -95.0]}, SHORT_LINE),
    (ESCORT, "mission", {"within_m": 40.0}, r"mission\.within_m = 40\.0: .*less than or equal to 30"),
    (FERRY, "passage", {"width_m": 4.0}, "passage.width_m = 4.0: narrower than the separation; allowed: guidance.s"),
    (FERRY, "passage", {"width_m": -1.0}, "passage.width_m = -1.0: .*greater than 0"),
    (FERRY, "passage", {"x_m": [40.0, -40.0]}, "passage.x_m = .*: allowed: a western and an eastern border within"),
    (FERRY, "passage", {"y_m": 119.0}, "passage.y_m = 119.0: allowed: -117 to 117, so that it lies within the wo"),
    (FERRY, "vehicle", {"start_m": [0.0, 0.0]}, r"vehicle.AUV00.start_m = .*in the reef, x -42.5 to 42.5, or its"),
    (FERRY, "rally_point", {"position_m": [0.0, 80.0]}, r"rally_point.tender.position_m = .*in the reef"),
    (FERRY, "delivery", {"from_m": [10.0, 0.0]}, r"delivery.load 1.from_m = \[10, 0\]: in the reef or its passage"),
    (FERRY, "delivery", {"to_m": [900.0, 0.0]}, "delivery.load 1.to_m = .*outside the world"),
    (FERRY, "delivery", {"name": "AUV03"}, 'delivery.AUV03.name = "AUV03": used 2 times'),
    (HUNT, "imagery", {"target_strips": 9}, "imagery.target_strips = 9: allowed: 1 to 8, the strips there are"),
    (HUNT, "imagery", {"sigma_db": 0.0}, "imagery.sigma_db = 0.0: .*greater than 0"),
    (HUNT, "mission", {"revisits": 41}, "mission.revisits = 41: .*less than or equal to 40"),
    (HUNT, "mission", {"revisits": 20}, "mission.view_m = 15.0: its views would be 4.46 m apart; 7 m or more"),
    (HUNT, "mission", {"confidence": 0.5}, "mission.confidence = 0.5: .*greater than 0.5"),
    (HUNT, "contact", {"name": "revisit 1"}, 'contact.revisit 1.name = "revisit 1": used 2 times'),
    (HUNT, "contact", {"position_m": [900.0, 0.0]}, r"contact.contact 1.position_m = .*: outside the world"),
    (RECOVERY, "lifts", {"vehicles": 5}, "lifts.vehicles = 5: an object takes more vehicles than .* allowed: 1 to 4"),
    (RECOVERY, "lifts", {"vehicles": 0}, "lifts.vehicles = 0: .*greater than or equal to 1"),
    (RECOVERY, "lifts", {"length_m": 6.0}, "lifts.length_m = 6.0: allowed: 8.25 or more, so that vehicles keep cl"),
    (RECOVERY, "lifts", {"number": 21}, "lifts.number = 21: .*less than or equal to 20"),
    (RECOVERY, "lifts", {"lift_s": 0.0}, "lifts.lift_s = 0.0: .*greater than 0"),
    (RECOVERY, "site", {"name": "lift 1"}, 'site.lift 1.name = "lift 1": used 2 times'),
    (RECOVERY, "site", {"position_m": [900.0, 0.0]}, r"site.site 1.position_m = \[900.0, 0.0\]: outside the world"),
    (RESUPPLY, "transfer", {"berth_m": 6.0}, "transfer.berth_m = 6.0: allowed: 8.25 to 20, so that vehicles keep"),
    (RESUPPLY, "transfer", {"efficiency": 1.2}, "transfer.efficiency = 1.2: .*less than or equal to 1"),
    (RESUPPLY, "transfer", {"power_w": 0.0}, "transfer.power_w = 0.0: .*greater than 0"),
    (RESUPPLY, "mission", {"wait_s": 0.0}, "mission.wait_s = 0.0: .*greater than 0"),
    (RESUPPLY, "boring", {"name": "site 1"}, 'boring.site 1.name = "site 1": used 2 times'),
    (RESUPPLY, "boring", {"position_m": [900.0, 0.0]}, r"boring.hole 1.position_m = .*: outside the world"),
    (RESUPPLY, "boring", {"position_m": [-240.0, 93.0]}, HOLE_2),
    (RESUPPLY, "boring", {"drill": "saw"}, 'boring.hole 1.drill = "saw": no vehicle has .* allowed: auger, corer'),
])  # fmt: skip
def test_a_table_that_cannot_be(tmp_path: Path, of: Varied, table: str, change: dict[str, Any], says: str) -> None:
    tables = of.raw()
    entry = tables[table]
    (entry[0] if isinstance(entry, list) else entry).update(change)
    refused(tmp_path, of, tables, rf"{re.escape(str(tmp_path))}/[a-z]+\.toml:\d+: {says}")


def refused(folder: Path, of: Varied, tables: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        load(str(of.written(folder, tables)))


def test_a_fleet_that_is_not_able_to_do_it(tmp_path: Path) -> None:
    lone, near = ESCORT.raw(), HUNT.raw()
    del lone["vehicle"][1:]
    refused(tmp_path, ESCORT, lone, r"line 2\.escorted = true: takes two vehicles, and there is one")
    x_m, y_m = near["contact"][0]["position_m"]
    near["contact"][1]["position_m"] = [x_m + 20.0, y_m]
    says = r"contact\.contact 2\.position_m = .*nearer than 45 m to contact\.contact 1"
    refused(tmp_path, HUNT, near, says)
    for of, says in ((HUNT, "contact = 12: nobody would see one"), (RECOVERY, r"lifts\.number = 4: nobody would find")):
        blind = of.raw()
        for vehicle in blind["vehicle"]:
            vehicle.pop("sensor", None)
        refused(tmp_path, of, blind, says)


@pytest.mark.parametrize(("of", "jobs"), [
    (ESCORT, {"line": 14}), (RECOVERY, {"site": 12, "lift": 4}), (RESUPPLY, {"site": 18, "hole": 8}), (FERRY, {}),
    (HUNT, {}),
])  # fmt: skip
def test_each_job_has_a_role_which_is_added_once(tmp_path: Path, of: Varied, jobs: dict[str, int]) -> None:
    once = load(str(of.written(tmp_path, of.raw())))
    assert mission_class(once.scenario.mission).completed(once) == once
    roles = {role.name: role for role in once.group[0].role}
    found = {role.job for role in roles.values() if role.job is not None}
    assert not jobs or found == {f"{kind} {n}" for kind, most in jobs.items() for n in range(1, most + 1)}
    if of is FERRY:
        assert "Carrier of load 1" in roles["Hand"].influences
        assert {"Carrier of load 2", "Hand", "Leader"} <= set(roles["Carrier of load 1"].influences)
