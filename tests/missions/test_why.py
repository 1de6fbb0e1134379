"""Answers to why a vehicle acts as it does, sentence by sentence against the tables of the run.

Each sentence has a grammar in ``GRAMMAR``, by which its names, times and numbers are looked up in the tables. A
sentence of no known grammar fails.
"""

import math
import random
import re
from collections.abc import Iterator
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any
from zlib import decompress

import pytest

from missions.errors import OutputError
from missions.runs.results import MemoryResults, Results, write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.why import MOST_LINES, NEEDED, Answer, Causes, Line, why
from remoras import stepping

LOST = "fault=[{vehicle='AUV01',kind='lost',at_s=90.0,until_s=200.0},{vehicle='AUV02',kind='joins',at_s=60.0}]"
EACH_LOST = ",".join(f"{{vehicle='{name}',kind='lost',at_s=316}}" for name in ("ASV00", "AUV00", "AUV01", "AUV02"))
AFLOAT = "fault=[{vehicle='AUV01',kind='restarts',at_s=5.0,until_s=60.0}]", "scenario.duration_s=200"
IDLE = 'mission.importance."Performer.RendezVous"=0'
CUT = 'channel.blackout=[{vehicle="AUV00",from_s=60.0,until_s=900.0}]'
LIFTS = "scenario.duration_s=700"
RUNS: dict[str, tuple[str, int, tuple[str, ...]]] = {
    "paper": ("mapping-rendezvous", 1, ("channel.name=perfect",)),
    "deaf to signals": ("mapping-rendezvous", 1, ("channel.name=perfect", "decision.weight_external=0")),
    "lossy": ("mapping-rendezvous", 1, ("channel.per=0.6",)),
    "no radio": ("mapping-rendezvous", 1, ("strategy.name=fixed-partition", "scenario.duration_s=1800")),
    "instant": ("mapping-rendezvous", 1, ("strategy.name=oracle", "scenario.duration_s=1800")),
    "bids": ("mapping-rendezvous", 1, ("strategy.name=cbba", "channel.per=0.3", "scenario.duration_s=1800")),
    "faults": ("mapping-rendezvous", 1, (LOST, "scenario.duration_s=400")),
    "ended early": ("mapping-rendezvous", 1, (f"fault=[{EACH_LOST}]",)),
    "services": ("pandora-inspection", 2, ("channel.per=0.3",)),
    "survey": ("trident-intervention", 2, ("channel.per=0.3",)),
    "lifts": ("recovery-field", 1, (LIFTS,)),
    "auction": ("recovery-field", 3, ("strategy.name=central", "strategy.parameters.help=auction", LIFTS)),
    "search": ("arrows-archaeology", 1, ("scenario.duration_s=500",)),
    "no importance": (
        "mapping-rendezvous",
        1,
        ("mission.importance.Exploring=0", IDLE, "navigation.drift=0.02", "scenario.duration_s=500"),
    ),
    "cut off": (
        "mapping-patches",
        1,
        ("strategy.name=contract-net", "channel.per=0.3", CUT, "scenario.duration_s=1200"),
    ),
    "no energy": ("mapping-rendezvous", 1, ("vehicle.AUV01.energy_j=60000", "scenario.duration_s=400")),
    "adrift": ("mapping-rendezvous", 1, (*AFLOAT, "world.x_m=[-5, 800]", "current.east_mps=-0.5")),
    "takeover": ("mapping-patches", 1, ("fault=[{vehicle='AUV01',kind='lost',at_s=1530}]", "scenario.duration_s=1800")),
}

LONG = {"deaf to signals", "lossy", "no radio", "instant", "bids", "services", "survey", "auction", "search"}


@cache
def recorded(name: str) -> MemoryResults:
    scenario, seed, settings = RUNS[name]
    return MemoryResults(run(load(scenario, [("--set", one) for one in settings]), seed))


@cache
def rows(name: str, table: str) -> list[dict[str, Any]]:
    return recorded(name).table(table).to_pylist()


# Law ----------------------------------------------------------------------------------------------

Row = dict[str, Any]
ACT = r"\w+(?: \+ \w+)*(?: \([^()]+\))?"
T, N, ACTS = r"(\d+\.\d) s", r"(-?[\d.]+)", rf"{ACT}(?:(?:, | and ){ACT})*"
MEAN = rf", in a combination of mean motivation {N}"
SENT = rf"(?:; (\w+) sent it at {T} in slot (\d+) of the run(?:, (\d+) lost since {T})?)?"
DONE = r"(?: \(milestone (\w+)\))?"
FORMS = [
    rf"left (?P<ended>{ACTS}) for (?P<begun>{ACTS})(?: beside (?P<stayed>{ACTS}))?",
    rf"began (?P<begun>{ACTS})(?: beside (?P<stayed>{ACTS}))?",
    rf"ended (?P<ended>{ACTS}) and went on with (?P<stayed>{ACTS})",
    rf"ended (?P<ended>{ACTS}) and waited|waited",
]
GRAMMAR = {
    "turn": rf"(\w+) ((?:left|began|ended|waited).*?) at {T}{DONE}"
    rf"(?:; this lasted until (?:{T}|the run's end at {T}))?\.",
    "won": rf"(.+?) won at {T} with motivation {N} \(stimulus {N}(?:, own {N}, {N} by a call of weight {N})?\)"
    rf"(?:{MEAN})?; (?:nothing else had a stimulus"
    rf"|the best that lost, (.+?), had {N}(?: \(importance 0\))?(?:{MEAN})?)\.",
    "vital": rf"(\w+) is vital and precedes all else; its stimulus at {T} was {N}: "
    rf"(?:of {N} kJ (\w+) had {N} kJ left, and the way home of {N} m needs {N} kJ, with a margin of 25 %"
    rf"|(\w+) was {N} m outside the area of operations"
    rf"|(\w+) had gone {N} m since its (last fix|start), at a drift of {N} %)\.",
    "lost": rf"({ACT}) had motivation {N}( \(importance 0\)|{MEAN}|, in no valid combination) at {T}\.",
    "idle": rf"No activity of (\w+)'s roles had a stimulus at {T}\.",
    "satisfied": rf"(\w+)'s satisfaction, -128 to 127, was (.+) in its slot at {T}\.",
    "signal": rf"(\w+) received (\w+)'s signal at {T} in slot (\d+) of the run: (-\d+) as ([\w ]+)"
    r"(?:; weaker: (.+))?\.",
    "request": rf"(\w+) received (\w+)'s request for help at {T} in slot (\d+) of the run\.",
    "sent": rf"(\w+) sent it at {T}(?: while it performed ({ACTS}))?(?:, dissatisfied since {T})?\.",
    "plan": rf"(\w+)'s (?:plan for|step (.+?) of) (\w+)\((.+?)\) as (.+?) was (\w+) at {T}(?:: (.+))?\.",
    "ran": rf"(\w+)'s step (.+) ran from {T} on\.",
    "ceased": rf"(\w+)'s ({ACTS}) had no stimulus any more at {T}\.",
    "left": rf"(\w+) left the role (.+?) at {T}, as (\w+) (?:decided|(took its place)|gave it to (\w+))\.",
    "noted": rf"(\w+) noted at {T}: (.+?), (.+)\.",
    "news": rf"(\w+) recorded at {T} that (\w+) of (.+?) is (.+?)"
    rf"(?:{SENT}; (\w+) received it at {T})?\.",
    "order": rf"(\w+) decided at {T} that (.+?)"
    rf"(?:{SENT}; (\w+) received it at {T})?, in effect at {T}\.",
    "ruled": rf"(\w+) decided that (.+?), in effect at {T}\.",
    "agreed": r"Agreed before the mission: (.+)\.",
    "out": rf"(\w+) was out of the mission from {T} to (?:{T}|the end): (.+)\.",
    "back": rf"(\w+) was back in the mission at {T} and went on with ({ACTS})\.",
}
OF_OTHERS = {"won", "lost", "vital", "news", "order", "ruled", "agreed"}
"""Sentences that begin with something else than the vehicle of their line."""


class Checked:
    """Sentences of a run, looked up in its tables; ``kinds`` of all that were found true."""

    def __init__(self, name: str) -> None:
        self.name, self.kinds = name, set[str]()

    def some(self, table: str, **wanted: Any) -> list[Row]:
        """Rows with these values; a text of digits stands for a number that is printed so."""
        return [row for row in rows(self.name, table) if all(same(row[key], one) for key, one in wanted.items())]

    def __call__(self, line: Line) -> None:
        found = {kind: match for kind, text in GRAMMAR.items() if (match := re.fullmatch(text, line.text))}
        assert found, f"no known sentence: {line.text}"
        kind, match = next(iter(found.items()))
        assert kind in OF_OTHERS or match[1] == line.vehicle
        assert getattr(self, kind)(line, *match.groups()), (kind, match.groups())
        assert near(line.time_s, *re.findall(rf" {T}", line.text)) or kind == "agreed"
        self.kinds.add(kind)

    def acts(self, vehicle: str, time: Any, text: str | None, chosen: bool = True) -> list[Row]:
        """Rows of a decision for these activities; all of them have to be there."""
        at = self.some("decisions", vehicle=vehicle, time_s=time, chosen=chosen)
        named = [parted(one) for one in re.split(", | and ", text)] if text else []
        found = [row for row in at if (" + ".join(row["activities"]), row["role"]) in named]
        assert {(" + ".join(row["activities"]), row["role"]) for row in found} == {*named}, (time, text)
        return found

    # Kinds ----------------------------------------------------------------------------------------

    def turn(self, line, who, words, time, milestone, until, end) -> bool:
        forms = [found for form in FORMS if (found := re.fullmatch(form, words))]
        assert forms, words
        ended, begun, stayed = (forms[0].groupdict().get(name) for name in ("ended", "begun", "stayed"))
        times_s = sorted({row["time_s"] for row in self.some("decisions", vehicle=who)})
        at = times_s.index(line.time_s)
        now = [*self.acts(who, line.time_s, begun), *self.acts(who, line.time_s, stayed)]
        gone = self.acts(who, times_s[at - 1], ended)
        meant = [(row["activities"], row["role"], row["argument"]) for row in now]
        assert not [row for row in gone if (row["activities"], row["role"], row["argument"]) in meant]
        for one in times_s[at:]:
            if until is None or one > float(until) - 0.06:
                break
            self.acts(who, one, begun or stayed)
        assert not until or self.some("decisions", vehicle=who, time_s=until) or self.some("faults", time_s=until)
        summary = recorded(self.name).summary
        assert end is None or near(max(row["time_s"] for row in rows(self.name, "trajectories")), end)
        found = [one["name"] for one in summary["milestones"] if one["vehicle"] == who and near(one["time_s"], time)]
        return milestone is None or milestone in found

    def won(self, line, act, time, motivation, stimulus, own, external, weight, mean, lost, lost_by, lost_mean) -> bool:
        same_label = self.acts(line.vehicle, line.time_s, act)
        row = next(one for one in same_label if near(one["own"] + one["external"], motivation))
        others = self.some("decisions", vehicle=line.vehicle, time_s=line.time_s, chosen=False)
        others = [other for other in others if other["stimulus"] > 0.0]
        assert near(row["stimulus"], stimulus)
        assert (own is None and not row["external"]) or (near(row["own"], own) and near(row["external"], external))
        assert weight is None or float(weight) == recorded(self.name).scenario.decision.weight_external
        assert mean is None or near(row["best_mean"], mean)
        if lost is None:
            return not others
        rival = max(others, key=worth)
        assert rival in self.acts(line.vehicle, line.time_s, lost, chosen=False)
        assert near(rival["own"] + rival["external"], lost_by)
        return lost_mean is None or near(rival["best_mean"], lost_mean)

    def lost(self, line, act, motivation, why_lost, mean, time) -> bool:
        others = self.some("decisions", vehicle=line.vehicle, time_s=line.time_s)
        assert not [row for row in others if row["chosen"] and row["role"]]
        rival = max((row for row in others if row["stimulus"] > 0.0 and not row["chosen"]), key=worth)
        assert near(rival["own"] + rival["external"], motivation)
        assert worth(rival)[0] == ("importance" not in why_lost)
        return rival in self.acts(line.vehicle, line.time_s, act, chosen=False)

    def vital(
        self, line, act, time, stimulus, full, who, left, way, needed, outside, off, lost, gone, since, drift
    ) -> bool:
        rows = self.some("decisions", vehicle=line.vehicle, time_s=line.time_s, chosen=True, role="", best_mean=None)
        assert any(row["activities"] == [act] and near(row["stimulus"], stimulus) for row in rows)
        assert line.vehicle == (who or outside or lost)
        scenario = recorded(self.name).scenario
        (data,) = (vehicle for vehicle in scenario.vehicle if vehicle.name == line.vehicle)
        if lost:
            return self.drifted(line, gone, since) and float(drift) == 100.0 * scenario.of_feature("navigation").drift
        (at,) = self.some("trajectories", vehicle=line.vehicle, time_s=line.time_s)
        if outside:
            return act == "ReturningToArea" and near(scenario.world.x_m[0] - at["x_m"], off)
        home_m = math.dist((at["x_m"], at["y_m"]), data.start_m)
        # Power times time of the way at survey speed; 1.25 is the margin of the vehicles.
        need_kj = 1.25e-3 * (data.hotel_w + data.drag_w_per_mps3 * data.survey_speed_mps**3) * home_m
        assert near(need_kj / data.survey_speed_mps, needed)
        assert near(home_m, way)
        assert near(data.energy_j / 1000.0, full)
        assert near((data.energy_j - at["energy_j"]) / 1000.0, left)
        return act == "ReturningHome" and float(left) <= float(needed)

    def drifted(self, line, gone, since) -> bool:
        """True if it has gone so far since its last spell of this activity ended."""
        done: dict[float, set[str]] = {}
        for row in self.some("activities", vehicle=line.vehicle):
            done.setdefault(row["time_s"], set()).add(row["name"])
        ends_s = [at_s for (_, old), (at_s, new) in pairwise(done.items()) if "FixingPosition" in old - new]
        from_s = max((at_s for at_s in ends_s if at_s < line.time_s), default=-1.0)
        assert (from_s > 0.0) == (since == "last fix")
        track = [
            row for row in self.some("trajectories", vehicle=line.vehicle) if from_s < row["time_s"] <= line.time_s
        ]
        places = [(row["x_m"], row["y_m"]) for row in track]
        return near(sum(math.dist(*two) for two in pairwise(places)), gone)

    def idle(self, line, who, time) -> bool:
        decided = self.some("decisions", vehicle=who, time_s=line.time_s)
        return not [row for row in decided if row["role"] and row["stimulus"]]

    def satisfied(self, line, who, values, time) -> bool:
        told = re.findall(r"(-?\d+) as (?:\w+\.)?(.+?)(?=, -?\d| and -?\d|$)", values)
        return bool(told) and all(self.some("satisfaction", vehicle=who, time_s=time, role=r, value=v) for v, r in told)

    def signal(self, line, who, source, heard, slot, value, role, weaker) -> bool:
        (packet,) = self.some("packets", slot=int(slot), sender=source)
        assert near(dict(zip(packet["receivers"], packet["arrivals_s"], strict=True))[who], heard)
        for name, other, at in re.findall(rf"(\w+)'s (-\d+) at {T}", weaker or ""):
            assert any(
                int(other) in row["signal_values"]
                and near(dict(zip(row["receivers"], row["arrivals_s"], strict=True)).get(who, -1.0), at)
                for row in self.some("packets", sender=name)
            )
        return (int(value), role) in [
            (of, name.partition(".")[2])
            for of, name in zip(packet["signal_values"], packet["signal_roles"], strict=True)
        ]

    def request(self, line, who, source, heard, slot) -> bool:
        (packet,) = self.some("packets", slot=int(slot), sender=source)
        told = [uid for uid in packet["status_uids"] if self.some("items", uid=uid, attribute="isToHelp", subject=who)]
        return bool(told) and near(dict(zip(packet["receivers"], packet["arrivals_s"], strict=True))[who], heard)

    def sent(self, line, who, time, acts, since) -> bool:
        (packet,) = self.some("packets", slot=line.slot, sender=who)
        before = [row["time_s"] for row in self.some("decisions", vehicle=who) if row["time_s"] <= packet["time_s"]]
        roles = {row["role"] for row in self.acts(who, before[-1], acts)}
        low = [
            row for row in self.some("satisfaction", vehicle=who)
            if row["role"] in roles and since and float(since) - 0.06 < row["time_s"] <= packet["time_s"]
        ]  # fmt: skip
        assert all(row["value"] < 0 for row in low)
        return near(packet["time_s"], time) and (since is None or not acts or near(low[0]["time_s"], since))

    def plan(self, line, who, step, objective, argument, role, status, time, method) -> bool:
        of = {"objective": objective, "argument": argument, "role": role, "status": status, "time_s": time}
        return bool(
            self.some("plans", vehicle=who, **of, **({"task": step} if step else {"node": 0, "method": method or ""}))
        )

    def ran(self, line, who, step, time) -> bool:
        return bool(self.some("plans", vehicle=who, task=step, status="running", time_s=time))

    def ceased(self, line, who, acts, time) -> bool:
        decided = self.some("decisions", vehicle=who, time_s=line.time_s)
        return not [row for row in decided if row["stimulus"] and f"{row['activities'][0]} ({row['role']})" in acts]

    def left(self, line, who, role, time, issuer, took, heir) -> bool:
        (at,) = self.some("organisation", vehicle=who, peer=who, role=role, event="left", time_s=time)
        heirs = self.some("organisation", vehicle=who, role=role, event="assigned", time_s=time)
        assert [row["peer"] for row in heirs] == ([issuer] if took else [heir] if heir else [])
        return at["issuer"] == issuer or issuer == "it"

    def noted(self, line, who, time, kind, detail) -> bool:
        return bool(self.some("faults", vehicle=who, time_s=time, kind=kind, detail=detail))

    def carried(self, line, uid, sender, sent, slot, n_lost, since, who, heard) -> bool:
        """True if the item reached a vehicle so; without packets, at once."""
        if who is None:
            return bool(self.some("items", uid=uid, origin=line.vehicle))
        assert who == line.vehicle
        if sender is None:
            return bool(self.some("knowledge", vehicle=who, item=uid, time_s=heard)) or not rows(self.name, "packets")
        (packet,) = self.some("packets", slot=int(slot), sender=sender)
        arrival_s = dict(zip(packet["receivers"], packet["arrivals_s"], strict=True))[who]
        others = [row for row in rows(self.name, "packets") if uid in row["item_uids"] and row["time_s"] < arrival_s]
        lost_s = [row["time_s"] for row in others if who not in row["receivers"]]
        assert int(n_lost or 0) == len(lost_s)
        assert not lost_s or near(lost_s[0], since)
        return uid in packet["item_uids"] and near(packet["time_s"], sent) and near(arrival_s, heard)

    def news(self, line, origin, time, attribute, subject, value, *how) -> bool:
        items = self.some("items", origin=origin, recorded_s=time, attribute=attribute, subject=subject, value=value)
        return any(self.carried(line, item["uid"], *how) for item in items)

    def order(self, line, issuer, time, words, *how_and_since) -> bool:
        *how, since = how_and_since
        for word, attribute, subject, value in assigned(words):
            items = self.some("items", origin=issuer, recorded_s=time, attribute=attribute)
            items = [one for one in items if one["subject"].endswith(subject) and one["value"].endswith(value)]
            assert any(self.carried(line, item["uid"], *how) for item in items), word
        return self.ruled(line, issuer, words, since)

    def ruled(self, line, issuer, words, time) -> bool:
        for _, attribute, subject, value in assigned(words):
            role, given = (value, {"peer": subject}) if attribute == "playsRole" else (subject, {"argument": value})
            own = self.some("organisation", vehicle=line.vehicle, issuer=issuer, time_s=time, role=role[1:], **given)
            assert [row for row in own if attribute in ("playsRole", f"objective{row['objective']}")], words
        return True

    def agreed(self, line, words) -> bool:
        return self.ruled(line, "", words, 0.0)

    def out(self, line, who, since, until, how) -> bool:
        return all(self.some("faults", vehicle=who, time_s=time) for time in (since, until) if time) and all(
            row["kind"] in how for row in self.some("faults", vehicle=who, time_s=since)
        )

    def back(self, line, who, time, acts) -> bool:
        before = [row["time_s"] for row in self.some("decisions", vehicle=who) if row["time_s"] < line.time_s]
        self.acts(who, before[-1], acts)
        return bool(self.some("faults", vehicle=who, time_s=time, detail="over"))


def parted(act: str) -> tuple[str, str]:
    """Activities and role of a label."""
    names, _, role = act.partition(" (")
    return names, role.rstrip(")").rpartition(".")[2]


def worth(row: Row) -> tuple[bool, float, float]:
    """Order of candidates: any with a motivation first."""
    motivation = row["own"] + row["external"]
    return motivation > 0.0, row["best_mean"] or 0.0, motivation


def near(value: float, *texts: str) -> bool:
    """True if a number is printed as one of the texts."""
    return any(f"{value:.{len(text.partition('.')[2])}f}" == text for text in texts)


def same(value: Any, wanted: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, float | int) or not isinstance(wanted, str):
        return bool(value == wanted)
    return near(value, wanted)


def assigned(words: str) -> list[tuple[str, str, str, str]]:
    """Words, attribute, subject and value of each assignment in a sentence."""
    found = []
    for word in re.split(r" and (?=[^()]+ is for )", words):
        if plays := re.fullmatch(r"(\w+) plays (?:\w+\.)?(.+)", word):
            found.append((word, "playsRole", plays[1], f".{plays[2]}"))
        else:
            aim = re.fullmatch(r"(?:\w+\.)?(.+) is for (\w+)\((.+)\)", word)
            assert aim, word
            found.append((word, f"objective{aim[2]}", f".{aim[1]}", aim[3]))
    return found


NEEDED_KINDS = {
    "paper": {"turn", "won", "idle", "satisfied", "signal", "sent", "plan", "news", "order", "agreed", "ceased"},
    "lossy": {"signal", "sent"},
    "faults": {"out", "back"},
    "no radio": {"plan", "agreed"},
    "instant": {"news"},
    "services": {"plan", "noted"},
    "survey": {"ran", "order"},
    "lifts": {"signal", "sent"},
    "auction": {"request"},
    "cut off": {"left"},
    "no energy": {"vital"},
    "no importance": {"lost", "vital", "won"},
    "adrift": {"vital"},
}
"""Sentences that answers of a run must contain, so that none goes unchecked."""


MARKS = dict.fromkeys(LONG, pytest.mark.slow) | dict.fromkeys(("bids", "search"), pytest.mark.thorough)


@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in RUNS])
def test_each_fact_of_an_answer_is_in_the_tables(name: str) -> None:
    causes, checked = Causes(recorded(name)), Checked(name)
    moments = {vehicle: [] for vehicle in causes.vehicles}
    for vehicle, from_s, lines in causes.moments():
        assert 1 <= len(lines) <= MOST_LINES
        moments[vehicle].append(from_s)
        for line in lines:
            checked(line)
    draw = random.Random(name)
    for vehicle in causes.vehicles:
        for at_s in (draw.uniform(0.0, recorded(name).ended_s) for _ in range(12)):
            answer = why(recorded(name), vehicle, at_s)
            holds_s = max([from_s for from_s in moments[vehicle] if from_s <= at_s], default=None)
            premise = answer.lines[0].text.startswith(f"{vehicle} changed nothing at")
            if holds_s is not None and premise:
                assert all(abs(from_s - at_s) >= 1.0 for from_s in moments[vehicle])
                assert answer.lines[1:] == tuple(causes.lines(vehicle, holds_s)[: MOST_LINES - 1])
    assert checked.kinds >= NEEDED_KINDS.get(name, set())


def altered(text: str, vehicles: list[str]) -> Iterator[str]:
    """The sentence with one number or one vehicle exchanged for another."""
    for found in re.finditer(r"(?<![\w.-])-?\d+(?:\.\d+)?(?! to 127)(?<!to 127)", text):
        n_digits = len(found[0].partition(".")[2])
        number = float(found[0]) + (1.0 if n_digits < 2 else 0.1)
        yield f"{text[: found.start()]}{number:.{n_digits}f}{text[found.end() :]}"
    for found in re.finditer("|".join(vehicles), text):
        other = next(name for name in vehicles if name != found[0])
        yield f"{text[: found.start()]}{other}{text[found.end() :]}"


@pytest.mark.parametrize(("name", "least", "word"), [("paper", 200, ""), ("no energy", 8, " vital ")])
def test_check_of_facts_finds_altered_sentences(name: str, least: int, word: str) -> None:
    causes, checked = Causes(recorded(name)), Checked(name)
    n_found = n_altered = 0
    for line in sorted({line for _, _, lines in causes.moments() for line in lines if word in line.text}):
        for text in altered(line.text, causes.vehicles):
            n_altered += 1
            try:
                checked(line._replace(text=text))
            except (AssertionError, IndexError, KeyError, StopIteration, ValueError):
                n_found += 1
    assert n_altered >= least
    assert n_found >= 0.98 * n_altered, n_found / n_altered


def texts(answer: Answer) -> str:
    return "\n".join(line.text for line in answer.lines)


def test_answer_names_the_signal_that_called_the_leader_off() -> None:
    """REMORAS, section VII: AUV00 gives up exploring as AUV01 waits at the rally point."""
    (stopped,) = [one for one in recorded("paper").summary["milestones"] if one["name"] == "mapping_stopped"]
    answer = why(recorded("paper"), "AUV00", stopped["time_s"])
    heard, sent = (next(line for line in answer.lines if word in line.text) for word in ("received", "sent it"))
    (row,) = [
        one for one in rows("paper", "decisions")
        if one["time_s"] == stopped["time_s"] and one["vehicle"] == "AUV00" and one["chosen"] and one["source"]
    ]  # fmt: skip
    packet = next(one for one in rows("paper", "packets") if one["slot"] == row["slot"])
    assert heard.text.startswith(f"AUV00 received {row['source']}'s signal")
    assert heard.time_s == dict(zip(packet["receivers"], packet["arrivals_s"], strict=True))["AUV00"]
    assert (sent.vehicle, sent.time_s, sent.slot) == (row["source"], packet["time_s"], row["slot"])
    assert "milestone mapping_stopped" in texts(answer)


def test_page_on_causes_prints_lines_of_the_answer() -> None:
    page = (Path(__file__).parents[2] / "docs" / "howto" / "replay.md").read_text(encoding="utf-8")
    printed = page.partition("```text\n")[2].partition("```")[0].splitlines()
    assert len({*printed} - {"..."}) > 2
    assert {*printed} - {"..."} <= {line.text for line in why(recorded("paper"), "AUV00", 1906).lines}


def test_act_of_a_run_under_way_lasts() -> None:
    with stepping("mapping-rendezvous", set=LIFTS) as steps:
        next(state for state in steps if state.time_s >= 60.0)
        page = steps.shown()
    text = decompress(page, -15).decode(errors="replace")
    assert "AUV00 began Mapping (Cartographer)" in text
    assert "; this lasts." in text
    assert "until the run's end" not in text


def test_a_way_home_is_explained_in_a_run_under_way() -> None:
    settings = ("vehicle.AUV01.energy_j=60000", "communication.count_listening=true", "scenario.duration_s=400")
    with stepping("mapping-rendezvous", set=settings) as steps:
        next(state for state in steps if state.time_s >= 150.0)
        page = steps.shown()
    assert "kJ left, and the way home of" in decompress(page, -15).decode(errors="replace")


@pytest.mark.slow
def test_without_weight_of_signals_neither_event_nor_explanation_exists() -> None:
    deaf = recorded("deaf to signals")
    assert "mapping_stopped" not in [one["name"] for one in deaf.summary["milestones"]]
    told = [line.text for _, _, lines in Causes(deaf).moments() for line in lines]
    assert told
    assert not [text for text in told if "signal" in text or "mapping_stopped" in text]


def test_answer_names_the_assignment_by_which_another_takes_over() -> None:
    causes = Causes(recorded("takeover"))
    for row in rows("takeover", "organisation"):
        begins = row["time_s"] > 1530.0 and (row["event"], row["peer"]) == ("assigned", row["vehicle"])
        if begins and re.search(
            rf"\({row['role']}\) at", (answer := causes.lines(row["vehicle"], row["time_s"]))[0].text
        ):
            assert any(f"{row['vehicle']} plays {row['role']}" in line.text for line in answer), answer
            return
    pytest.fail("no vehicle takes over")


def test_answer_corrects_a_question_about_another_vehicle() -> None:
    milestones = recorded("paper").summary["milestones"]
    done = {one["vehicle"]: one["time_s"] for one in milestones if one["name"] == "mapping_done"}
    first = why(recorded("paper"), "AUV02", done["AUV01"]).lines[0].text
    assert first.startswith(f"AUV02 changed nothing at {done['AUV01']:.1f} s: it was AUV01 that left Mapping")
    assert first.endswith(f"the nearest change of AUV02 was at {done['AUV02']:.1f} s.")


@pytest.mark.parametrize(("instead", "reason"), [
    ("Mapping", "had motivation 0.45, in a combination of mean motivation 0.3343 at 1906.0 s, Homing (Coordi"),
    ("Performer", "at 1906.0 s; in AUV00's view AUV01 and AUV02 held Performer; it never began it"),
    ("Operational.Coordinator", "AUV00 did perform Homing (Coordinator) then"),
    ("MissionPlanner", "MissionPlanner (Coordinator) had no stimulus at 1906.0 s"),
])  # fmt: skip
def test_answer_tells_why_an_alternative_was_rejected(instead: str, reason: str) -> None:
    *_, last = why(recorded("paper"), "AUV00", 1906.0, instead).lines
    assert last.text.startswith(f"Not {instead}: ")
    assert reason in last.text


def test_holder_of_a_role_is_named_as_a_belief() -> None:
    """The viewer believes in a holder who learns of its role later."""
    own_s = {(row["vehicle"], row["role"]): row["time_s"] for row in rows("takeover", "roles")[::-1]}
    early = [
        row for row in rows("takeover", "organisation")
        if row["event"] == "assigned" and row["vehicle"] != row["peer"]
        and own_s.get((row["peer"], row["role"]), 0.0) > row["time_s"] + 2.0
    ]  # fmt: skip
    assert early
    for row in early:
        *_, last = why(recorded("takeover"), row["vehicle"], row["time_s"] + 1.1, row["role"]).lines
        assert f"; in {row['vehicle']}'s view {row['peer']} held {row['role']}" in last.text


def test_rejection_names_the_roles_that_a_vehicle_can_play() -> None:
    *_, last = why(recorded("paper"), "ASV00", 1000.0, "Midfield").lines
    assert "it was not in the group Operational; it was not eligible, its playable_roles are MissionAd" in last.text


def test_rejection_names_the_state_of_the_plan() -> None:
    *_, last = why(recorded("paper"), "AUV02", 2012.0, "Mapping").lines
    (plan,) = [
        row for row in rows("paper", "plans")
        if (row["vehicle"], row["objective"], row["node"], row["status"]) == ("AUV02", "Mapping", 0, "done")
    ]  # fmt: skip
    assert f"its plan was done ({plan['method']}) since {plan['time_s']:.1f} s" in last.text


@pytest.mark.parametrize(("asked", "message"), [
    (("AUV9", 5.0), "no vehicle 'AUV9'; there are ASV00, AUV00, AUV01, AUV02; did you mean"),
    (("AUV00", 5000.0), "time 5000.0; allowed: 0 to 2045 s, the end of the run"),
    (("AUV00", -1.0), "time -1.0; allowed: 0 to"),
    (("AUV00", float("nan")), "time nan; allowed: 0 to"),
    (("AUV00", 5.0, "Maping"), "no role or activity 'Maping'; there are .*; did you mean 'Mapping'"),
])  # fmt: skip
def test_unknown_names_and_times_are_refused(asked: tuple[Any, ...], message: str) -> None:
    with pytest.raises(OutputError, match=message):
        why(recorded("paper"), *asked)


def test_times_after_the_end_of_a_run_that_ended_early_are_refused() -> None:
    """Its mission time is the whole duration, of which it has no rows."""
    run = recorded("ended early")
    assert (run.summary["mission_time_s"], run.ended_s) == (14400.0, 316.0)
    assert run.known("AUV00", 316.0).at_s == 316.0
    assert run.knowledge("AUV00")
    for ask in (run.known, partial(why, run)):
        with pytest.raises(OutputError, match=r"allowed: 0 to 316(\.0)?( s)?, the end of the run"):
            ask("AUV00", 400.0)


@pytest.mark.parametrize("table", NEEDED)
def test_results_without_a_table_are_refused(table: str, tmp_path: Path) -> None:
    write_results(recorded("faults"), tmp_path / "run")
    (tmp_path / "run" / f"{table}.parquet").unlink()
    with pytest.raises(OutputError, match=f"no table '{table}'"):
        why(Results.read(tmp_path / "run"), "AUV00", 5.0)
