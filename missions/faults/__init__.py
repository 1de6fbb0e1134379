"""What may befall a vehicle, one file for each kind: see ``missions.fault``. Only tests import one by name."""

__all__: list[str] = []
