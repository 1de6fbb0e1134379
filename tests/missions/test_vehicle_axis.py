"""The number of vehicles as an axis of a study."""

import json
from pathlib import Path

from sweeping import study_text, written

from missions.comparison.baseline import compare
from missions.sweeps.driver import sweep
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.study import load_study


def axis_text(vehicles: str, repeats: int = 2) -> str:
    text = study_text(repeats=repeats, per="0.4").replace('policies = ["ack", "mps-ack"]', 'policies = ["ack"]')
    return text.replace("seed = 7", f"seed = 7\nvehicles = {vehicles}")


def test_the_size_is_an_ordinary_setting_of_ledger_table_and_comparison(tmp_path: Path) -> None:
    """Sizes come in the order of numbers: 4 before 16, which as words would come after."""
    study = load_study(str(written(tmp_path, axis_text("[16, 4, 8]"))))
    sweep(study, tmp_path / "out", jobs=1)
    lines = [json.loads(line) for line in (tmp_path / "out" / LEDGER).read_text(encoding="utf-8").splitlines()]
    assert len(lines) == 3 * 2
    assert all(line["settings"]["fleet.size"] == line["summary"]["n_vehicles"] for line in lines)
    results = SweepResults.read(tmp_path / "out")
    assert sorted(results.runs()["n_vehicles"]) == sorted(results.runs()["fleet.size"]) == [4, 4, 8, 8, 16, 16]
    assert [row.settings["fleet.size"] for row in compare(results, ["n_bytes"])] == ["4", "8", "16"]
