"""Independent verification of results: discrepancies between tables, summary and scenario.

It imports no other package of this project; expected values follow docs/howto/results.md and docs/model/.
"""

from missions.verification.folder import verify
from missions.verification.record import CheckReport, NoResults

__all__ = ["CheckReport", "NoResults", "verify"]
