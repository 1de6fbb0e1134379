"""The shipped field of sites and objects for tests: its tables, and runs of it with settings changed."""

from varied import Varied

from missions.runs.run import Run

FIELD = Varied("recovery-field", "field.toml")
raw, written, flown = FIELD.raw, FIELD.written, FIELD.flown


def events(of: Run, event: str) -> dict[str, float]:
    """When a lift came to an event, by name."""
    return {row[2]: row[0] for row in of.recorder.rows("lifts") if row[3] == event}
