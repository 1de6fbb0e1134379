"""Field work: jobs that need more than one vehicle, namely helpers, right of way, or energy.

Missions: lifts by several vehicles (``recovery-field``), loads through a narrow passage (``ferry-passage``), escorted
line surveys (``escort-lines``), drilling with delivered energy (``resupply-field``).
"""

from missions.fieldwork.mission import EscortMission, FerryMission, RecoveryMission, ResupplyMission

__all__ = ["EscortMission", "FerryMission", "RecoveryMission", "ResupplyMission"]
