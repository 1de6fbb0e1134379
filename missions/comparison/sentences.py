"""Statistical statements of a comparison, in the English of papers; none without its number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from missions.comparison.baseline import Comparison
from missions.comparison.effects import ALL, MainEffect
from missions.comparison.table import number
from missions.comparison.treatments import MISSION_TIME, SIGNIFICANT
from missions.metric import Metric
from missions.statistics import FEW, detectable, least_p
from missions.sweeps.folder import is_bound
from missions.sweeps.study_file import PER, level_name
from missions.words import from_to, within

MINUS = "\u2212"
UNITLESS = ("", "1")


class Statement(NamedTuple):
    """Sentence on a treatment and the baseline; ``significant`` is None if no difference is tested."""

    subject: str
    text: str
    significant: bool | None


@dataclass(frozen=True)
class Wording:
    """Words for the rows of one metric: what varies in a study names treatments and conditions."""

    metric: Metric
    rows: Sequence[Comparison]

    @property
    def label(self) -> str:
        """Name of the metric within a sentence."""
        return within(self.metric.label)

    @property
    def unit(self) -> str:
        """Unit behind a number, with a space; empty without one."""
        return "" if self.metric.unit in UNITLESS else f" {self.metric.unit}"

    def _varies(self, column: str) -> bool:
        return len({getattr(row, column) for row in self.rows}) > 1

    @property
    def _setting(self) -> str:
        key, equals, _ = self.rows[0].baseline.partition("=")
        return key if equals else ""

    def subject(self, row: Comparison) -> str:
        """Return the name of a treatment: strategy, policy or level of the baseline's key."""
        if self._setting:
            return level_name(f"{self._setting}={row.settings.get(self._setting, row.per)}")
        strategies, policies = self._varies("strategy"), self._varies("policy")
        return (
            f"{row.strategy} with {row.policy}" if strategies and policies else row.policy if policies else row.strategy
        )

    def baseline(self, row: Comparison) -> str:
        """Return the name of the treatment that a row is compared with."""
        given = row.baseline
        if self._setting or not (self._varies("strategy") and self._varies("policy")):
            return given
        is_strategy = any(other.strategy == given for other in self.rows)
        return f"{given} with {row.policy}" if is_strategy else f"{row.strategy} with {given}"

    def conditions(self, row: Comparison) -> str:
        """Return the conditions that vary in the study, such as `` at PER 0.8 (unforeseen: one vehicle lost)``."""
        parts = [getattr(row, column) for column in ("scenario", "channel") if self._varies(column)]
        if self._setting:
            parts += [getattr(row, column) for column in ("strategy", "policy") if self._varies(column)]
        varied = {key for key in row.settings if len({other.settings.get(key) for other in self.rows}) > 1}
        parts += [f"{key.rpartition('.')[2]} {row.settings[key]}" for key in sorted(varied - {self._setting})]
        parts += [f"unforeseen: {row.unforeseen}"] if self._varies("unforeseen") else []
        at = f" at PER {row.per:g}" if self._varies("per") and self._setting != PER else ""
        return f"{at} ({', '.join(parts)})" if parts else at

    def of(self, row: Comparison) -> Statement:
        """Return the statement of a row with a difference to the baseline."""
        assert row.diff_to_baseline is not None
        subject, other, where = self.subject(row), self.baseline(row), self.conditions(row)
        n_both = row.n_pairs if row.n_pairs_reached is None else row.n_pairs_reached
        if 2 * n_both < row.n_pairs:
            text = f"{subject} completed {row.n_completed} of {row.n} runs{self._success(row)}{where}; "
            return Statement(
                subject,
                f"{text}with {other}, both completed in {n_both} of {row.n_pairs} pairs, so no difference is stated.",
                None,
            )
        names = f"{subject} and {other}"
        if row.diff_to_baseline == 0.0 and row.diff_spread in (0.0, None):
            text = f"{names} were equal in {self.label}{where} ({instances(row.n_pairs)}, paired)."
            return Statement(subject, text, False)
        significant = row.p_holm is not None and row.p_holm < SIGNIFICANT
        sign = -1.0 if significant and row.diff_to_baseline < 0.0 else 1.0
        ends_of = (row.diff_ci95_low, row.diff_ci95_high)
        bounds = sorted(sign * bound for bound in ends_of if bound is not None)
        shown, *ends = map(amount, (sign * row.diff_to_baseline, *bounds))
        parts = [f"95 % CI {ends[0]} to {ends[1]}" if ends else "no interval", instances(row.n_pairs), "paired"]
        if n_both < row.n_pairs:
            parts += [f"both completed {n_both} of {row.n_pairs} pairs, restricted mean"]
        evidence = ", ".join([*parts, self._p(row)])
        if not significant:
            verdict = "did not differ significantly" if row.p_holm is not None else "are compared without a test"
            signed = f"{'+' * (row.diff_to_baseline > 0.0)}{shown}{self.unit}"
            text = f"{names} {verdict} in {self.label}{where}: mean difference {signed} ({evidence})."
            return Statement(subject, text, False if row.p_holm is not None else None)
        less = row.diff_to_baseline < 0.0
        is_time = self.metric.name == MISSION_TIME
        word = ("faster" if less else "slower") if is_time else ("lower" if less else "higher")
        what = "" if is_time else f" in {self.label}"
        return Statement(
            subject, f"{subject} was {word} than {other}{what}{where} by {shown}{self.unit} ({evidence}).", True
        )

    def _success(self, row: Comparison) -> str:
        low, high = row.success_ci95_low, row.success_ci95_high
        known = "deterministic" if low is None or high is None else f"95 % CI {100 * low:.0f} to {100 * high:.0f} %"
        return f" ({known}{', significantly below the highest success rate' * row.unequal_success})"

    def _p(self, row: Comparison) -> str:
        if row.p_holm is None:
            return "deterministic" if row.n_pairs <= 1 else "no test"
        least = least_p(row.n_pairs)
        few = f", and {row.n_pairs} pairs allow none below {least:.2g}" if least >= SIGNIFICANT else ""
        return f"step-down p {'< 0.001' if row.p_holm < 0.001 else f'= {row.p_holm:.2g}'}{few}"


def amount(value: float) -> str:
    """Return a value as in tables, with a minus sign."""
    return MINUS * (value < 0.0) + number(abs(value))


def instances(n: int) -> str:
    """Return the number of instances, such as ``n = 8 instances``."""
    return f"n = {n} instance{'s' * (n != 1)}"


def effect_statements(metric: Metric, rows: Sequence[MainEffect]) -> list[Statement]:
    """Return the statements on the main effects of a factorial study; significant by their own interval."""
    found = []
    for row in (row for row in rows if row.is_main):
        wording = Wording(metric, ())
        shown, *ends = (amount(b) for b in (row.effect, row.ci95_low, row.ci95_high) if b is not None)
        significant = None if row.ci95_low is None or row.ci95_high is None else row.ci95_low > 0 or row.ci95_high < 0
        verdict = {None: "without a test", False: "not significant", True: "significant"}[significant]
        interval = f"95 % CI {ends[0]} to {ends[1]}" if ends else "no interval"
        sign, condition = "+" * (row.effect > 0.0), "all conditions" if row.condition == ALL else row.condition
        text = (
            f"{row.term} from {row.low} to {row.high} changed {wording.label} by {sign}{shown}{wording.unit} "
            f"({condition}; {interval}, {instances(row.n)}, paired, no correction): {verdict}."
        )
        found.append(Statement(row.term, text, significant))
    return found


def statements(metric: Metric, rows: Sequence[Comparison]) -> list[Statement]:
    """Return the statements on all rows of a metric that are compared with the baseline."""
    wording = Wording(metric, rows)
    return [wording.of(row) for row in rows if row.diff_to_baseline is not None]


def power(metric: Metric, rows: Sequence[Comparison]) -> str:
    """Return a sentence on the smallest detectable difference of the pairs that all completed; empty without any."""
    found = [
        (row.n_pairs, row.diff_spread)
        for row in rows
        if row.diff_spread and row.n_pairs_reached in (None, row.n_pairs) and not is_bound(row.strategy)
    ]
    tested = [(n, spread) for n, spread in found if n >= FEW]
    if not tested:
        most = max((n for n, _ in found), default=0)
        return f"{most} pairs or fewer allow no interval and no p below {least_p(most):.2g}." if most else ""
    wording, sizes = Wording(metric, rows), [detectable(spread, n) for n, spread in tested]
    low, high = amount(min(sizes)), amount(max(sizes))
    spreads = [amount(end(spread for _, spread in tested)) for end in (min, max)]
    return (
        f"The smallest difference that n = {from_to(n for n, _ in tested)} instances detect with 80 % power in a "
        "single paired comparison at 5 % (Student's t, before the step-down correction) is "
        f"{low} to {high}{wording.unit}, by the observed standard deviations of the paired differences, "
        f"{spreads[0]} to {spreads[1]}{wording.unit}."
    )
