"""Jobs at places, of which some take more than the vehicle that has them: others to help, room to pass, or energy.

Four missions: objects are lifted by several vehicles (``recovery-field``), loads carried through a narrow passage
(``ferry-passage``), lines surveyed with an escort (``escort-lines``), holes bored with energy that others bring
(``resupply-field``). Their scenarios, vocabularies and studies are in the folders beside this one.
"""

from missions.fieldwork.mission import EscortMission, FerryMission, RecoveryMission, ResupplyMission

__all__ = ["EscortMission", "FerryMission", "RecoveryMission", "ResupplyMission"]
