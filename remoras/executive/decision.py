"""Decision: satisfaction of roles, motivation of activities, best combination (REMORAS, section V).

Satisfaction-altruism model of Simonin and Ferber (SAB 2000): personal satisfaction follows the perceived progress of a
role's task and is sent to the group as a signed byte; a dissatisfied peer moves others to respond. The paper prints no
equations: ``docs/model/decision.md`` has these, with the constants of ``DecisionTable``.

Vital sets with a stimulus are taken first, by order, not by weight. A combination holds at most one activity of each
type and whole sets, each with the activity it needs, and is *maximal*: no motivated set could be added. (Otherwise the
single most motivated activity would have the best mean and always be alone.) The combination with the best mean
motivation wins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from pydantic import Field

from exchange.arithmetic import exp
from remoras.activities import ActivityKind, ActivitySet
from remoras.table import NotNegative, Positive, Section

LOWEST, HIGHEST = -128, 127


class DecisionTable(Section):
    """The table ``[decision]``: constants of the equations above; rates are per second."""

    period_s: Positive = Field(2.0, description="time between two decisions of the executive layer")
    weight_continuing: NotNegative = Field(0.1, description="weight of the motivation to continue")
    weight_external: NotNegative = Field(2.0, description="weight of the motivation to respond to influence signals")
    gain_per_s: NotNegative = Field(1.0, description="satisfaction gained per second of progress")
    tedium_per_s: float = Field(-1.8, le=0.0, description="satisfaction change per second without progress")
    dismay_per_s: float = Field(-2.0, le=0.0, description="satisfaction change per second of setback")
    fade_per_s: NotNegative = Field(0.5, description="rate at which satisfaction in an idle role returns to 0")
    signal_memory_frames: Positive = Field(8.5, description="TDMA frames in which a received signal fades to 1/e")
    signal_memory_receptions: NotNegative = Field(
        0.0, description="minimum of that time, in mean times between receptions at the measured loss; 0: no minimum"
    )
    updates_satisfy: bool = Field(
        True, description="updates satisfy a leader; false: performed activities alone, so that a waiting leader calls"
    )

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.weight_continuing >= 1.0 + self.weight_external:
            yield (
                "weight_continuing",
                f"must be below {1.0 + self.weight_external:g} = 1 + weight_external; else a vehicle could never leave "
                "its activity, whatever is pending and whichever peer requests help",
            )

    def constants(self, frame_s: float) -> DecisionConstants:
        """Return the constants for a TDMA frame of ``frame_s`` seconds."""
        return DecisionConstants(**dict(self), signal_memory_s=self.signal_memory_frames * frame_s)


class DecisionConstants(DecisionTable):
    """Constants of the table plus ``signal_memory_s`` (tau), which follows from the TDMA frame."""

    signal_memory_s: Positive = 60.0

    def stretch(self, p_loss: float) -> float:
        """Return the factor, at least 1, on ``signal_memory_s`` over a link with that loss, 0 to below 1.

        >>> constants = DecisionConstants(signal_memory_frames=8.0, signal_memory_receptions=2.0)
        >>> constants.stretch(0.5), constants.stretch(0.875)
        (1.0, 2.0)
        """
        return max(1.0, self.signal_memory_receptions / (self.signal_memory_frames * (1.0 - p_loss)))


def evolved(satisfaction: float, advance: float | None, dt_s: float, constants: DecisionConstants) -> float:
    """Return personal satisfaction, -128..127, after ``dt_s``.

    ``advance`` is the progress of the role's objective, -1..1; None if the role is not pursued.

    >>> evolved(126.5, 1.0, 1.0, DecisionConstants())
    127
    >>> evolved(0.0, 0.5, 10.0, DecisionConstants(gain_per_s=1.0, tedium_per_s=-2.0))
    -5.0
    >>> evolved(0.25, None, 1.0, DecisionConstants())
    0.0
    """
    if advance is None:
        fade = constants.fade_per_s * dt_s
        return satisfaction - fade if satisfaction > fade else satisfaction + fade if satisfaction < -fade else 0.0
    towards = constants.gain_per_s if advance >= 0.0 else constants.dismay_per_s
    share = abs(advance)
    value = satisfaction + (share * towards + (1.0 - share) * constants.tedium_per_s) * dt_s
    return LOWEST if value < LOWEST else HIGHEST if value > HIGHEST else value


def signal_of(satisfaction: float) -> int:
    """Return the signed byte that encodes a satisfaction."""
    return max(LOWEST, min(HIGHEST, round(satisfaction)))


def call(value: int, age_s: float, constants: DecisionConstants) -> float:
    """Return the strength 0..1 of a call for help: dissatisfaction, faded with age."""
    return -value / 128.0 * exp(-age_s / constants.signal_memory_s) if value < 0 else 0.0


def contentment(stimulus: float, satisfaction: float) -> float:
    """Return satisfaction with own work, 0..1: remaining work times satisfaction in the role.

    >>> contentment(0.5, 127.0), contentment(1.0, -20.0)
    (0.5, 0.0)
    """
    return stimulus * max(0.0, satisfaction) / HIGHEST


def answered(strongest_call: float, answers: float, own: float) -> float:
    """Return the effect of a call, 0..1: strength times effect of responding, less ``own``.

    >>> answered(0.75, 1.0, 0.25), answered(0.75, 0.25, 0.25)
    (0.5, 0.0)
    """
    return max(0.0, strongest_call * answers - own)


def motivation(
    importance: float,
    stimulus: float,
    satisfaction: float | None,
    heeded: float,
    constants: DecisionConstants,
) -> float:
    """Return the motivation of an activity.

    ``satisfaction`` is that in its role while performed, else None; ``heeded`` the effect of calls (``answered``).

    >>> motivation(0.5, 1.0, 127.0, 0.0, DecisionConstants(weight_continuing=0.25))
    0.75
    """
    if stimulus <= 0.0:
        return 0.0
    value = importance * stimulus + constants.weight_external * heeded
    if satisfaction is not None:
        value += constants.weight_continuing * (satisfaction - LOWEST) / (HIGHEST - LOWEST)
    return value


# Combination -------------------------------------------------------------------------------------

_TYPES = 0xFF
"""Bits of a state for the types it holds; above: activities provided, then needed."""

ROUNDING = 1e-9
"""Bound on the rounding error of a mean of motivations."""

Sum = tuple[float, tuple[int, ...]]
"""Sum of motivations and the indices of its sets."""


class Choice:
    """Selection among activity sets by motivation.

    >>> from remoras.activities import Activity, ActivityType
    >>> def one(name, *types):
    ...     return ActivitySet(None, ActivityKind.INDIVIDUAL, tuple(Activity(name, t, (), ("s",)) for t in types), 1.0)
    >>> sets = one("tow", ActivityType.GUIDANCE, ActivityType.PRODUCTIVE), one("look", ActivityType.PRODUCTIVE)
    >>> Choice(sets).best([0.6, 0.9]), Choice(sets).best([0.6, 0.5])
    ((1,), (0,))
    """

    def __init__(self, sets: Sequence[ActivitySet]) -> None:
        needed = sorted({activities.needs for activities in sets if activities.needs is not None})
        self._n_needed = len(needed)
        self._sizes = [len(activities.effective) for activities in sets]
        self._bits: list[int] = []
        for activities in sets:
            names = {activity.name for activity in activities.activities}
            provided = sum(1 << bit for bit, name in enumerate(needed) if name in names)
            asked = 0 if activities.needs is None else 1 << needed.index(activities.needs)
            self._bits.append(activities.types | (provided | asked << self._n_needed) << 8)
        self._vital = [index for index, activities in enumerate(sets) if activities.kind is ActivityKind.VITAL]
        self._others = [
            (index, self._bits[index])
            for index, activities in enumerate(sets)
            if activities.kind is not ActivityKind.VITAL and self._sizes[index]
        ]
        self._best: tuple[int, ...] = ()
        self._found_at: list[float] = [math.nan] * len(sets)  # motivations of the last search
        self._apart: list[float] = []  # differences of motivations that the search compared
        self._holds_within = 0.0

    def best(self, motivations: Sequence[float]) -> tuple[int, ...]:
        """Return the sets of the best combination, ascending, first of equals; 0 takes no part."""
        if not self.holds(motivations):
            self._best, self._found_at = self.searched(motivations), list(motivations)
            self._holds_within = min(self._apart, default=math.inf) / 2.0 - ROUNDING
        return self._best

    def searched(self, motivations: Sequence[float]) -> tuple[int, ...]:
        """Compute ``best`` without the cache."""
        self._apart.clear()
        vital, held = self._needed_to_live(motivations)
        _, winner = self._most(motivations, held, held, (0.0, ()))
        return tuple(sorted(vital + winner)) if vital else winner

    def spare(self, motivations: Sequence[float], index: int) -> float:
        """Return by how much the motivation of a set may change without effect; NaN before a search."""
        return self._holds_within - abs(motivations[index] - self._found_at[index])

    def holds(self, motivations: Sequence[float]) -> bool:
        """Return whether the last search surely found the best combination."""
        # Means that differ by d keep their order until a motivation moves by d / 2, or from or to 0.
        within = self._holds_within
        for now, before in zip(motivations, self._found_at, strict=True):
            if now != before and (abs(now - before) >= within or (now > 0.0) is not (before > 0.0)):
                return False
        return True

    def best_mean(self, motivations: Sequence[float], index: int) -> float | None:
        """Return the mean motivation of the best combination with this set; None if vital or none."""
        _, held = self._needed_to_live(motivations)
        bits = self._bits[index]
        if index in self._vital or not motivations[index] > 0.0 or bits & held & _TYPES:
            return None
        mean, _ = self._most(motivations, held, held | bits, (self._sizes[index] * motivations[index], (index,)))
        return mean or None

    def _needed_to_live(self, motivations: Sequence[float]) -> tuple[tuple[int, ...], int]:
        vital: tuple[int, ...] = ()
        held = 0
        for index in self._vital:
            if motivations[index] > 0.0 and not held & self._bits[index] & _TYPES:
                vital += (index,)
                held |= self._bits[index]
        return vital, held

    def _most(self, motivations: Sequence[float], held: int, begun: int, sum_: Sum) -> Sum:
        """Return the greatest mean motivation and its sets, beside vital ``held`` from ``begun`` on."""
        fit = self._fit(motivations, begun & _TYPES)
        n_held, above = (held & _TYPES).bit_count(), 8 + self._n_needed
        highest = 0.0
        winner: tuple[int, ...] = ()
        for state, (total, summed) in self._sums(motivations, fit, begun, sum_).items():
            n = (state & _TYPES).bit_count() - n_held
            if not n:
                continue
            mean = total / n
            self._apart.append(abs(mean - highest))
            if mean >= highest and not state >> above & ~(state >> 8):  # all needs are provided
                chosen = tuple(sorted(summed))
                if (mean > highest or chosen < winner) and not self._takes_more(state, fit):
                    highest, winner = mean, chosen
        return highest, winner

    def _fit(self, motivations: Sequence[float], types: int) -> list[int]:
        """Return motivated sets without ``types``; of sets with equal bits the most motivated."""
        best_of: dict[int, int] = {}
        for index, bits in self._others:
            if motivations[index] > 0.0 and not bits & types:
                other = best_of.get(bits)
                if other is not None:
                    self._apart.append(abs(motivations[index] - motivations[other]))
                if other is None or motivations[index] > motivations[other]:
                    best_of[bits] = index
        return list(best_of.values())

    def _sums(self, motivations: Sequence[float], fit: Sequence[int], begun: int, sum_: Sum) -> dict[int, Sum]:
        beginning: dict[int, list[tuple[int, int, float]]] = {}  # by their lowest type
        alone = 0  # types of single-type sets without needs: never left free
        for index in fit:
            bits = self._bits[index]
            types = bits & _TYPES
            first = types & -types
            beginning.setdefault(first, []).append((index, bits, self._sizes[index] * motivations[index]))
            if types == first and not bits >> 8 + self._n_needed:
                alone |= first
        states = {begun: sum_}
        for first, group in sorted(beginning.items()):
            before, states = states, {}
            for state, (total, summed) in before.items():
                is_taken = state & first
                reached = [(state, total, summed)] if is_taken or not alone & first else []
                for index, bits, value in () if is_taken else group:
                    if not state & bits & _TYPES:
                        reached.append((state | bits, total + value, (*summed, index)))
                for after, most, chosen in reached:  # best sum per state, first of equals
                    # A combination has one activity per type, so its mean is its sum over the number of types: of all
                    # with the same types (at most 256 subsets) only the one with the best sum can win. The search is
                    # exact.
                    known = states.get(after)
                    if known is not None:
                        self._apart.append(abs(most - known[0]) / (after & _TYPES).bit_count())
                    if known is None or most > known[0] or (most == known[0] and sorted(chosen) < sorted(known[1])):
                        states[after] = most, chosen
        return states

    def _takes_more(self, state: int, fit: Sequence[int]) -> bool:
        above = 8 + self._n_needed
        for index in fit:
            if not state & self._bits[index] & _TYPES:
                more = state | self._bits[index]
                if not more >> above & ~(more >> 8):
                    return True
        return False
