"""Shared base of missions whose groups do jobs and then meet at a rally point.

Missions with further needs than ``JobMission``, such as ``missions.mapping``, combine ``Meeting`` and ``MeetingTruth``.
"""

from missions.meeting.job_mission import AnyonesJob, JobMission, JobScenario, JobSettings, ReportedJob, Stay, StayJob
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth, MeetingTruth

__all__ = [
    "AnyonesJob", "JobMission", "JobScenario", "JobSettings", "JobTruth", "Meeting", "MeetingTruth", "ReportedJob",
    "Stay", "StayJob",
]  # fmt: skip
