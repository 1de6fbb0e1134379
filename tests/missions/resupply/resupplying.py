"""The shipped field of sites and holes for tests: its tables, and runs of it with settings changed."""

from varied import Varied

from missions.runs.run import Run

FIELD = Varied("resupply-field", "field.toml")
raw, written, sampled = FIELD.raw, FIELD.written, FIELD.flown
OFF = "decision.weight_external=0.0"
FULL = ("vehicle.AUV03.sensor.corer.battery_j=1e6", "vehicle.AUV04.sensor.auger.battery_j=1e6")
EMPTY = tuple(f"vehicle.AUV0{number}.sensor.charger.store_j=0.0" for number in range(3))


def events(of: Run, event: str) -> list[tuple[float, str, str, float]]:
    """What befell holes: time, vehicle, hole, energy."""
    return [(row[0], row[1], row[2], row[4]) for row in of.recorder.rows("energy") if row[3] == event]
