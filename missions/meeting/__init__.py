"""What missions share whose groups do jobs and then meet: the meeting itself, and a mission with all but the jobs.

``JobMission`` asks its subclass for the jobs and for what a vehicle does at one. ``Meeting`` and ``MeetingTruth`` are
its parts, for missions that have more of their own, as ``missions.mapping`` has.
"""

from missions.meeting.job_mission import JobMission, JobScenario, JobSettings
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth, MeetingTruth

__all__ = ["JobMission", "JobScenario", "JobSettings", "JobTruth", "Meeting", "MeetingTruth"]
