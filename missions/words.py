"""Wording of axes, captions, reports and answers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

REPEAT = "-repeat"  # suffix of a policy under which others repeat items


def axis(label: str, unit: str = "") -> str:
    """Return an axis label with its unit, such as ``time (s)``; ``1`` is no unit."""
    return f"{label} ({unit})" if unit not in ("", "1") else label


def time(time_s: float) -> str:
    """Format a mission time, as ``2062 s`` from 100 s on, ``7.2 s`` below."""
    return f"{time_s:.0f} s" if time_s >= 100 else f"{time_s:.1f} s"


def listed(names: Sequence[str]) -> str:
    """Join names, as in ``a, b and c``; empty without any."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def from_to(numbers: Iterable[float]) -> str:
    """Return the least and the greatest number; one of them if they are equal, empty without any.

    >>> from_to([12, 30, 8]), from_to([8.0, 8]), from_to([])
    ('8 to 30', '8', '')
    """
    ordered = sorted(numbers)
    return " to ".join(dict.fromkeys(f"{number:g}" for number in (*ordered[:1], *ordered[-1:])))


def named_all(what: str, names: Iterable[str], several: str = "") -> str:
    """Return a noun with its distinct names, as in ``policies ack, m-ack``; ``several`` is its plural."""
    distinct = list(dict.fromkeys(names))
    return f"{what if len(distinct) == 1 else several or what + 's'} {', '.join(distinct)}"


def short_names(names: Iterable[str]) -> dict[str, str]:
    """Return plug-ins with their labels: the name of the object, with its module if another one is called so.

    >>> list(short_names(["cbba", "lab.turns:Turns", "lab.first:MINE", "other:MINE"]).values())
    ['cbba', 'Turns', 'first:MINE', 'other:MINE']
    """
    forms = {name: dict.fromkeys((name.rpartition(":")[2], name.rpartition(".")[2])) for name in names}
    taken = Counter(form for own in forms.values() for form in own)
    return {name: next((form for form in own if taken[form] == 1), name) for name, own in forms.items()}


def capital(text: str) -> str:
    """Capitalise the first letter."""
    return text[:1].upper() + text[1:]


def within(text: str) -> str:
    """Lower the first letter unless text begins with an abbreviation, such as PER."""
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]


def are(number: int) -> str:
    """Return a number with its verb, as in ``1 is`` and ``2 are``."""
    return f"{number} {'is' if number == 1 else 'are'}"


def joined(*sentences: str) -> str:
    """Join non-empty sentences."""
    return " ".join(sentence for sentence in sentences if sentence)
