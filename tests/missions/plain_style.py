"""Style for figures of missions, as the drawing package passes it."""

from types import SimpleNamespace


class PlainStyle:
    """Colours by vehicle."""

    black, grey = "#000000", "#666666"

    def __init__(self, **colours: str) -> None:
        self.looks = {name: SimpleNamespace(colour=of, line="-", marker="o") for name, of in colours.items()}

    def tint(self, colour: str, strength: float) -> tuple[float, float, float]:
        return {"red": (1.0, 0.8, 0.8), "blue": (0.8, 0.8, 1.0)}.get(colour, (1.0 - strength,) * 3)

    def axis(self, label: str, unit: str = "") -> str:
        return f"{label} in {unit}"

    def time(self, time_s: float) -> str:
        return f"{time_s} s"
