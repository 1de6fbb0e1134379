"""What exports read of a run with faults."""

from pathlib import Path

import remoras
from missions.runs.results import Results
from visualisation.exports.voyage import Voyage

FAULTS = [
    {"kind": "joins", "vehicle": "ASV00", "at_s": 20.0},
    {"kind": "lost", "vehicle": "AUV01", "at_s": 60.0, "until_s": 80.0},
    {"kind": "lost", "vehicle": "AUV02", "at_s": 90.0},
]


def test_a_vehicle_that_is_out_of_the_mission_is_said_to_be_out(tmp_path: Path) -> None:
    """From the second to the second that the scenario says; then it is driven by what drove it before."""
    remoras.run("mapping-rendezvous", set={"scenario.duration_s": 120.0, "fault": FAULTS}).save(tmp_path / "run")
    states = Voyage(Results.read(tmp_path / "run"), ()).states
    out = {name: [one.time_s for one in states if one.vehicle == name and one.text == "out"] for name in
           ("ASV00", "AUV00", "AUV01", "AUV02")}  # fmt: skip
    assert out == {"ASV00": [0.0], "AUV00": [], "AUV01": [60.0], "AUV02": [90.0]}
    assert min(one.time_s for one in states if one.vehicle == "ASV00" and one.text != "out") == 20.0
    of_auv01 = [one for one in states if one.vehicle == "AUV01"]
    lost = next(n for n, one in enumerate(of_auv01) if one.is_out)
    assert (of_auv01[lost + 1].time_s, of_auv01[lost + 1].roles) == (80.0, of_auv01[lost - 1].roles)
    assert [one for one in states if one.vehicle == "AUV02"][-1].is_out
