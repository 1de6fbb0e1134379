"""Minehunting (``minehunting-contacts``): contacts are viewed again and classified, mine or rock."""

from missions.minehunting.mission import MinehuntingMission

__all__ = ["MinehuntingMission"]
