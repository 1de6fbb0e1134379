"""Archaeological search without a central decider: every vehicle decides by its own map where to look next.

The shipped scenario is ``arrows-archaeology``; ``docs/missions/arrows.md`` says what it is for and what it shows.
"""

from missions.arrows.mission import ArrowsMission

__all__ = ["ArrowsMission"]
