"""Kinds of vehicle faults, one file each; see ``missions.fault``.

Only tests import them by name.
"""

__all__: list[str] = []
