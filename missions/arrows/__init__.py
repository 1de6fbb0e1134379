"""Arrows mission: decentralised archaeological search, each vehicle guided by its own map."""

from missions.arrows.mission import ArrowsMission

__all__ = ["ArrowsMission"]
