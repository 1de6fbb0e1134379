"""What a campaign found, for people and for programs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stress.campaign import Report
from stress.configurations import settings_line
from stress.kinds import FOR_GOOD
from stress.shrinking import Shrunk
from stress.trial import Broken, Outcome

COLUMN = 6


def as_value(report: Report) -> dict[str, Any]:
    """All that a campaign found, as one JSON value."""
    plan, table = report.plan, report.table()
    return {
        "scenario": plan.scenario,
        "strategy": plan.strategy,
        "settings": list(plan.settings),
        "drawn": _drawn(report),
        "usual_s": plan.usual_s,
        "completes_without_faults": plan.completes,
        "n_runs": len(report.outcomes),
        "n_broken": len(report.broken),
        "seeds": [outcome.seed for outcome in report.outcomes],
        "invariants": list(report.invariants),
        "table": [
            {"invariant": name, "kind": kind, "held": tally.held, "broken": tally.broken}
            for (name, kind), tally in sorted(table.items())
        ],
        "not_exercised": [
            {"invariant": name, "kind": kind}
            for name in report.invariants
            for kind in plan.kinds
            if not any((name, kind + ending) in table for ending in ("", FOR_GOOD))
        ],
        "happened": dict(sorted(report.happened.items())),
        "recovered": dict(sorted(report.recovered.items())),
        "broken": [_broken(outcome, outcome.broken) for outcome in report.broken if outcome.broken is not None],
        "shrunk": [
            {**_small(small), "toml": small.schedule.as_toml(), "scenario": small.schedule.as_scenario()}
            for small in report.shrunk.values()
        ],
        "wall_s": round(report.wall_s, 3),
    }


def _drawn(report: Report) -> dict[str, int]:
    """In how many schedules each setting was drawn, where any may be."""
    drawn = Counter(name for outcome in report.outcomes for name in outcome.schedule.settings)
    return {name: drawn[name] for name in report.plan.draws}


def _broken(one: Outcome, broken: Broken) -> dict[str, Any]:
    return {
        "seed": one.seed,
        "invariant": broken.invariant,
        "time_s": broken.time_s,
        "text": broken.text,
        "settings": {name: list(lines) for name, lines in one.schedule.settings.items()},
        "heal_s": one.schedule.stress.heal_s,
        "bound_s": one.schedule.stress.bound_s,
        "last_events": list(broken.before),
    }


def _small(small: Shrunk) -> dict[str, Any]:
    return {
        "invariant": small.broken.invariant,
        "seed": small.schedule.stress.seed,
        "n_faults": len(small.schedule.fault),
        "n_settings": len(small.schedule.settings),
        "n_runs": small.n_runs,
        "digest": small.digest,
    }


def replay_report(outcome: Outcome) -> dict[str, Any]:
    """What came of a schedule from a file, as one JSON value."""
    return {
        "seed": outcome.seed,
        "completed": outcome.completed,
        "end_s": outcome.end_s,
        "digest": outcome.digest,
        "settings": {name: list(lines) for name, lines in outcome.schedule.settings.items()},
        "scenario": outcome.schedule.as_scenario(),
        "happened": dict(sorted(outcome.happened.items())),
        "recovered": dict(sorted(outcome.recovered.items())),
        "judged": list(outcome.judged),
        "not_promised": list(outcome.not_promised),
        "broken": None if outcome.broken is None else _broken(outcome, outcome.broken),
    }


def lines(report: Report) -> Iterator[str]:
    """The report for people."""
    plan = report.plan
    how = f"completes in {plan.usual_s:.0f} s without faults" if plan.completes else "does not complete without faults"
    yield f"{plan.scenario} under {plan.strategy}: {how}"
    yield f"{len(report.outcomes)} schedules, {len(report.broken)} with a breach, {report.wall_s:.0f} s"
    yield from _table_lines(report)
    recovered = ", ".join(f"{way} {count}" for way, count in report.recovered.most_common())
    yield f"recoveries: {recovered or 'none'}"
    if plan.draws:
        drawn = ", ".join(f"{name} {count}" for name, count in _drawn(report).items() if count)
        yield f"settings drawn: {drawn or 'none'}"
    for name, small in report.shrunk.items():
        about, n_faults = small.schedule.stress, len(small.schedule.fault)
        yield ""
        yield f"{name} broken by seed {about.seed} at {small.broken.time_s:.1f} s: {small.broken.text}"
        faults = f"{n_faults} faults" if n_faults else "no fault"
        yield f"shrunk to {faults} in {small.n_runs} runs, with {settings_line(small.schedule.settings)}:"
        yield from (f"  {line}" for line in small.schedule.as_toml().splitlines())
        yield from _before(small.broken)


def _before(broken: Broken) -> Iterator[str]:
    yield "last events before it:"
    yield from (f"  {line}" for line in broken.before)


def replay_lines(outcome: Outcome) -> Iterator[str]:
    """What came of a schedule from a file, for people."""
    how = "completed" if outcome.completed else "not completed"
    bound = f"healed at {outcome.schedule.stress.heal_s:g} s, bound {outcome.schedule.stress.bound_s:g} s"
    yield f"seed {outcome.seed}: {how}, ended at {outcome.end_s:g} s; {bound}"
    yield f"drawn: {settings_line(outcome.schedule.settings)}"
    yield "happened: " + (", ".join(f"{kind} {count}" for kind, count in outcome.happened.items()) or "nothing")
    yield f"digest {outcome.digest}"
    if outcome.broken is None:
        yield f"held: {', '.join(outcome.judged)}"
        yield f"not promised under these faults: {', '.join(outcome.not_promised) or 'none'}"
    else:
        yield f"broken: {outcome.broken.invariant} at {outcome.broken.time_s:.1f} s: {outcome.broken.text}"
        yield from _before(outcome.broken)


def _table_lines(report: Report) -> Iterator[str]:
    """Kinds by invariants: in how many runs each held, or which seed broke it first."""
    table, plan = report.table(), report.plan
    yield "runs in which each invariant held under each kind; !N: broken by seed N; ..: not exercised or not promised"
    numbered = list(enumerate(report.invariants, 1))
    names = [f"{number} {name}" for number, name in numbered]
    for start in range(0, len(names), 7):
        yield "  " + "  ".join(names[start : start + 7])
    yield f"{'':<18}" + "".join(f"{number:>{COLUMN}}" for number, _ in numbered)
    happened = {kind for _, kind in table}
    for kind in plan.kinds:
        for row in [kind, *([kind + FOR_GOOD] if kind + FOR_GOOD in happened else [])]:
            tallies = [table.get((name, row)) for _, name in numbered]
            texts = [".." if c is None else f"!{c.broken[0]}" if c.broken else str(c.held) for c in tallies]
            yield f"{row:<18}" + "".join(f"{text:>{COLUMN}}" for text in texts)


def write_report(report: Report, draft: Path) -> None:
    """Write the report and the schedules of all breaches into a folder."""
    import json

    (draft / "report.json").write_text(json.dumps(as_value(report), indent=2) + "\n", encoding="utf-8")
    (draft / "report.txt").write_text("\n".join(lines(report)) + "\n", encoding="utf-8")
    for outcome in report.broken:
        (draft / f"seed-{outcome.seed}.toml").write_text(outcome.schedule.as_toml(), encoding="utf-8")
    for name, small in report.shrunk.items():
        (draft / f"shrunk-{name}.toml").write_text(small.schedule.as_toml(), encoding="utf-8")
        (draft / f"shrunk-{name}.scenario.toml").write_text(small.schedule.as_scenario(), encoding="utf-8")
