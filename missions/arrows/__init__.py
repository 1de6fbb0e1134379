"""Arrows mission: decentralised archaeological search, each vehicle guided by its own map.

Scenario: ``arrows-archaeology``; purpose and results: ``docs/missions/arrows.md``.
"""

from missions.arrows.mission import ArrowsMission

__all__ = ["ArrowsMission"]
