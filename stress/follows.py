"""That the tables and the figures of a run follow from one another, as ``remoras verify`` reads them."""

from __future__ import annotations

import json

from missions.runs.results import MODEM_KEYS
from missions.runs.tables import arrow_table
from missions.verification.folder import verify_run
from missions.verification.record import CheckReport, Record, TableColumns
from stress.invariants.seam import Moment, Scene

DAMAGED, LATE = {"knowledge", "received", "acknowledged", "senders"}, {"arrivals", "knowledge", "senders"}
UNTOLD = {
    "bits": DAMAGED, "cut": DAMAGED, "forged": DAMAGED, "twice": LATE, "late": LATE, "forged-done": {"milestones"},
}  # fmt: skip
"""Checks of ``remoras verify`` that ask what no table tells under a kind of fault that no scenario declares."""


class Follows:
    """``remoras verify``, which knows nothing of the program, finds nothing in the results that does not follow."""

    name = "follows"
    moment = Moment.END
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Give the results, as they would be written, to the checker."""
        if (run := scene.finished) is None:
            return None
        recorder, modem = run.recorder, run.setup.modem
        tables = {
            name: TableColumns(arrow_table(table, recorder.rows(name))) for name, table in recorder.tables.items()
        }
        written = run.scenario.model_dump(mode="json", exclude_none=True)
        profile = {key: getattr(modem, key) for key in MODEM_KEYS}
        report = CheckReport()
        verify_run(Record(written, run.seed, json.loads(json.dumps(scene.summary)), tables, profile), report)
        untold = set[str]().union(*(UNTOLD[kind] for kind in scene.schedule.kinds & UNTOLD.keys()))
        return next((str(finding) for finding in report.findings if finding.check not in untold), None)
