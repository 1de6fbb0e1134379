"""Field work: jobs that need more than their holder, namely helpers, an escort, right of way or delivered energy."""

from missions.fieldwork.mission import EscortMission, FerryMission, RecoveryMission, ResupplyMission

__all__ = ["EscortMission", "FerryMission", "RecoveryMission", "ResupplyMission"]
