"""An independent reading of results: what of a folder does not follow from its tables and its scenario.

Nothing here imports anything of ours. What should follow is worked out from docs/howto/results.md and docs/model/.
"""

from missions.verification.folder import verify
from missions.verification.record import CheckReport, NoResults

__all__ = ["CheckReport", "NoResults", "verify"]
