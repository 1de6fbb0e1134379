"""Kinds of vehicle faults, one file each; see ``missions.fault``."""

__all__: list[str] = []
