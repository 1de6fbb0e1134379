"""Functional layer of a vehicle: sensors, vital needs, motion and energy."""

__all__: list[str] = []
