"""Shared base of missions whose groups do jobs and then meet at a rally point.

``JobMission`` asks its subclass for the jobs and the behaviour at a job. Missions with further needs, such as
``missions.mapping``, combine ``Meeting`` and ``MeetingTruth`` themselves.
"""

from missions.meeting.job_mission import AnyonesJob, JobMission, JobScenario, JobSettings, ReportedJob, Stay, StayJob
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth, MeetingTruth

__all__ = [
    "AnyonesJob", "JobMission", "JobScenario", "JobSettings", "JobTruth", "Meeting", "MeetingTruth", "ReportedJob",
    "Stay", "StayJob",
]  # fmt: skip
