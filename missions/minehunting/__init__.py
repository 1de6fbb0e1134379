"""Minehunting: contacts of an earlier survey are viewed again and classified, mine or rock.

An analyst decides by the received image snippets, and requests another view of undecided contacts. Scenario:
``minehunting-contacts``.
"""

from missions.minehunting.mission import MinehuntingMission

__all__ = ["MinehuntingMission"]
