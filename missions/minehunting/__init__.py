"""Contacts of an earlier survey are looked at again, and snippets of the images decide which of them are mines.

An analyst decides by what it was told; what nobody could tell apart is looked at once more. Its scenario is
``minehunting-contacts``.
"""

from missions.minehunting.mission import MinehuntingMission

__all__ = ["MinehuntingMission"]
