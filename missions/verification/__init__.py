"""Independent verification of results: it imports no other package, expectations follow docs/howto/results.md."""

from missions.verification.folder import verify
from missions.verification.record import CheckReport, NoResults

__all__ = ["CheckReport", "NoResults", "verify"]
