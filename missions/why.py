"""Causes of a vehicle's actions, as lines of text from the tables of a run.

An answer explains the last change of activity by the time asked: its motives, then the signal, or the plan and the
assignment behind it. It states only what the tables hold; no table holds a reason as such. A candidate of a decision
has a cause elsewhere if its motivation has an external part (a signal), if a plan or step ended with the former
activity, or if a fact became known within the frame before; else the assignment of its role and objective remains.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, starmap, takewhile
from operator import itemgetter
from typing import Any, NamedTuple

from exchange.arithmetic import distance
from missions.decisions import Decision, Key, Row, decisions_of, key_of, motivation_of
from missions.errors import OutputError
from missions.fault import absences
from missions.figure import RunResults
from missions.words import listed
from remoras.database import HOME_MARGIN, power_w
from worldmodel import suggestion

NEEDED = ("decisions", "packets", "items", "knowledge", "organisation", "satisfaction", "plans", "faults")
MOST_LINES = 8
NEAR_S = 1.0
"""Difference below which two times are one moment to a user, who rounds to seconds."""
OVER = ("done", "failed", "dropped")
PLAYS, OBJECTIVE = "playsRole", "objective"  # attributes of assignments; those of objectives begin with it


class Line(NamedTuple):
    """One fact of an answer: text, time (s) and vehicle; ``slot`` of its packet, if any."""

    text: str
    time_s: float
    vehicle: str
    slot: int | None = None


@dataclass(frozen=True, repr=False)
class Answer:
    """Causes of a vehicle's action at a time, the action first; its ``repr`` is the text."""

    vehicle: str
    at_s: float
    lines: tuple[Line, ...]

    def __repr__(self) -> str:
        return "\n".join(line.text for line in self.lines)


class Turn(NamedTuple):
    """Decision that changed the acts, and the one ``before`` it; None for the first, also after a restart."""

    vehicle: str
    decision: Decision
    before: Decision | None

    @property
    def time_s(self) -> float:
        """Time of the decision."""
        return self.decision.time_s

    @property
    def since_s(self) -> float:
        """Time of the decision before."""
        return -math.inf if self.before is None else self.before.time_s

    @property
    def former(self) -> dict[Key, Row]:
        """Acts before."""
        return {} if self.before is None else self.before.acts

    @property
    def begun(self) -> dict[Key, Row]:
        """Acts that it began."""
        return {key: row for key, row in self.decision.acts.items() if key not in self.former}

    @property
    def ended(self) -> list[Row]:
        """Acts that it ended."""
        return [row for key, row in self.former.items() if key not in self.decision.acts]

    @property
    def main(self) -> Row | None:
        """Act to explain: of those begun, else of those continued, the one most moved by a signal; None while waiting.

        A vital act comes first.
        """
        acts = (self.begun or self.decision.acts).values()
        return max(acts, key=lambda row: (not row["role"], row["external"], row["own"]), default=None)


def why(run: RunResults, vehicle: str, at_s: float, instead: str = "") -> Answer:
    """Explain what a vehicle did at ``at_s``, and why not a role or activity ``instead``, if given.

    Raises OutputError for an unknown vehicle, time, role or activity, or without a needed table.
    """
    for table in NEEDED:
        run.table(table)
    return Causes(run).answer(vehicle, at_s, instead)


class Causes:
    """Causes of all actions in a run; a table that is missing counts as empty."""

    def __init__(self, run: RunResults) -> None:
        self._run, self._scenario = run, run.scenario_tables
        self._read: dict[str, Mapping[str, list[Row]]] = {}
        self._decision = self._scenario.get("decision", {})
        self._end_s = run.ended_s
        self.vehicles = [vehicle["name"] for vehicle in self._scenario.get("vehicle", ())]
        self._absences: dict[str, list[tuple[float, bool]]] = {name: [] for name in self.vehicles}
        faults = ((row["time_s"], row["vehicle"], row["kind"], row["detail"]) for row in run.rows("faults"))
        for since_s, vehicle, is_away in absences(faults):
            self._absences[vehicle].append((since_s, is_away))
        self._decisions = {name: list(decisions_of(self._rows("decisions")[name])) for name in self.vehicles}
        self._turns = {name: list(self._turns_of(name)) for name in self.vehicles}

    def _turns_of(self, vehicle: str) -> Iterator[Turn]:
        before: Decision | None = None
        for decision in self._decisions[vehicle]:
            if any(at_s == decision.time_s for at_s, _ in self._absences[vehicle]):
                before = None  # it has restarted
            if before is None or decision.acts.keys() != before.acts.keys():
                yield Turn(vehicle, decision, before)
            before = decision

    def answer(self, vehicle: str, at_s: float, instead: str = "") -> Answer:
        """Return the answer to a user; OutputError for an unknown vehicle, time, role or activity."""
        if vehicle not in self.vehicles:
            known = ", ".join(self.vehicles)
            raise OutputError(f"no vehicle {vehicle!r}; there are {known}{suggestion(str(vehicle), self.vehicles)}")
        if not isinstance(at_s, float | int) or not 0.0 <= at_s <= self._end_s:
            raise OutputError(f"time {at_s}; allowed: 0 to {self._end_s:g} s, the end of the run")
        near_s = min(self._changes_s(vehicle), key=lambda change_s: abs(change_s - at_s), default=math.inf)
        is_meant = abs(near_s - at_s) < NEAR_S
        moment_s = near_s if is_meant else float(at_s)
        has_premise = self._turns[vehicle] and not is_meant and not self._away(vehicle, moment_s)[1]
        first = [self._premise(vehicle, moment_s)] if has_premise else []
        last = [self._rejection(vehicle, moment_s, instead)] if instead else []
        lines = self.lines(vehicle, moment_s)[: MOST_LINES - len(first) - len(last)]
        return Answer(vehicle, float(at_s), (*first, *lines, *last))

    def moments(self) -> Iterator[tuple[str, float, list[Line]]]:
        """Yield vehicle, time from which an answer holds, and its lines, in time order per vehicle."""
        for vehicle in self.vehicles:
            for at_s in self._changes_s(vehicle):
                yield vehicle, at_s, self.lines(vehicle, at_s)

    def _changes_s(self, vehicle: str) -> list[float]:
        turns, absences_of = self._turns[vehicle], self._absences[vehicle]
        return sorted({*(turn.time_s for turn in turns), *(at_s for at_s, _ in absences_of)})

    def _away(self, vehicle: str, at_s: float) -> tuple[float, bool]:
        """Return whether a vehicle was out of the mission, and since when."""
        return max([(0.0, False), *(one for one in self._absences[vehicle] if one[0] <= at_s)])

    def lines(self, vehicle: str, at_s: float) -> list[Line]:
        """Return the causes of what a vehicle did at a time, at most ``MOST_LINES``."""
        since_s, is_away = self._away(vehicle, at_s)
        past = [turn for turn in self._turns[vehicle] if turn.time_s <= at_s]
        lines = self._of(past[-1]) if past else []
        if is_away:
            faults = [row for row in self._rows("faults")[vehicle] if row["time_s"] == since_s]
            how = listed([f"{row['kind']}, {row['detail']}" if row["detail"] else row["kind"] for row in faults])
            until_s = next((_s(end_s) for end_s, _ in self._absences[vehicle] if end_s > since_s), "the end")
            text = f"{vehicle} was out of the mission from {_s(since_s)} to {until_s}: {how}."
            lines.insert(0, Line(text, since_s, vehicle))
        elif not past:
            return [Line(f"{vehicle} had made no decision by {_s(at_s)}.", at_s, vehicle)]
        elif past[-1].time_s < since_s:  # its choice outlasted the absence
            acts = self._names(past[-1].decision.acts.values()) or "waiting"
            text = f"{vehicle} was back in the mission at {_s(since_s)} and went on with {acts}."
            lines.insert(0, Line(text, since_s, vehicle))
        return lines[:MOST_LINES]

    # What it did ---------------------------------------------------------------------------------

    def _of(self, turn: Turn) -> list[Line]:
        text = f"{turn.vehicle} {self._text(turn)} at {_s(turn.time_s)}{self._milestone(turn)}; {self._end(turn)}"
        lines = [Line(f"{text}.", turn.time_s, turn.vehicle), *self._motives(turn)]
        return lines + self._causes(turn, {(turn.vehicle, turn.time_s)})

    def _text(self, turn: Turn) -> str:
        begun, ended = self._names(turn.begun.values()), self._names(turn.ended)
        stayed = self._names(row for key, row in turn.decision.acts.items() if key in turn.former)
        if not turn.decision.acts:
            return f"ended {ended} and waited" if ended else "waited"
        if not begun:
            return f"ended {ended} and went on with {stayed}"
        return (f"left {ended} for {begun}" if ended else f"began {begun}") + (f" beside {stayed}" if stayed else "")

    def _end(self, turn: Turn) -> str:
        """Return when the acts that the turn began ended or, if it began none, its combination."""
        begun, acts = turn.begun.keys(), turn.decision.acts.keys()
        later = [decision for decision in self._decisions[turn.vehicle] if decision.time_s > turn.time_s]
        ends_s = [one.time_s for one in later if not (begun <= one.acts.keys() if begun else acts == one.acts.keys())]
        gone_s = [at_s for at_s, _ in self._absences[turn.vehicle] if at_s > turn.time_s]
        end_s = min([*ends_s[:1], *gone_s], default=None)
        if end_s is None and self._run.summary.get("is_underway"):
            return "this lasts"
        return f"this lasted until {_s(end_s)}" if end_s else f"this lasted until the run's end at {_s(self._end_s)}"

    def _milestone(self, turn: Turn) -> str:
        names = [
            one["name"] for one in self._run.summary.get("milestones", ())
            if one["vehicle"] == turn.vehicle and abs(one["time_s"] - turn.time_s) < 0.001  # it is rounded there
        ]  # fmt: skip
        return f" (milestone {listed(names)})" if names else ""

    def _premise(self, vehicle: str, at_s: float) -> Line:
        """Correct a question about a time without a change: name the nearest one, and whose change it was then."""

        def distance_s(turn: Turn) -> float:
            return abs(turn.time_s - at_s)

        near = min(self._turns[vehicle], key=distance_s)
        other = min((turn for turns in self._turns.values() for turn in turns), key=distance_s)
        text = f"{vehicle} changed nothing at {_s(at_s)}"
        if distance_s(other) < NEAR_S:
            text += f": it was {other.vehicle} that {self._text(other)} at {_s(other.time_s)}{self._milestone(other)}"
        text += f"; the nearest change of {vehicle} was at {_s(near.time_s)}"
        if near.time_s > at_s:
            text += f", when it {self._text(near)}{self._milestone(near)}"
        return Line(f"{text}.", near.time_s, vehicle)

    # Motives -------------------------------------------------------------------------------------

    def _motives(self, turn: Turn) -> list[Line]:
        vehicle, time_s, won = turn.vehicle, turn.time_s, turn.main
        rival = _best(row for row in turn.decision.rows if not row["chosen"])
        if won is None:
            if rival is not None:
                return [Line(f"{self._lost(turn.decision, rival, vehicle)}.", time_s, vehicle)]
            return [Line(f"No activity of {vehicle}'s roles had a stimulus at {_s(time_s)}.", time_s, vehicle)]
        if not won["role"]:
            text = f"{self._name(won)} is vital and precedes all else; its stimulus at {_s(time_s)} was"
            need = self._need(vehicle, won["activities"][0], time_s)
            return [Line(f"{text} {won['stimulus']:.2f}{need}.", time_s, vehicle)]
        parts = f"stimulus {won['stimulus']:.2f}"
        if won["external"] > 0.0:
            weight = f" of weight {self._decision['weight_external']:g}" if "weight_external" in self._decision else ""
            parts += f", own {won['own']:.2f}, {won['external']:.2f} by a call{weight}"
        text = f"{self._name(won)} won at {_s(time_s)} with motivation {_value(won)} ({parts}){_mean(won)}"
        lost = "nothing else had a stimulus"
        if rival is not None:
            lost = f"the best that lost, {self._name(rival)}, had {_value(rival)}{_mean(rival)}"
        roles = dict.fromkeys((row["group"], row["role"]) for row in (won, rival) if row is not None)
        return [Line(f"{text}; {lost}.", time_s, vehicle), *self._satisfactions(vehicle, time_s, roles)]

    def _need(self, vehicle: str, activity: str, at_s: float) -> str:
        """Return the energy or place that gave a vital activity its stimulus; empty if no table has it."""
        track = _until(self._rows("trajectories")[vehicle], at_s)
        data = next(one for one in self._scenario["vehicle"] if one["name"] == vehicle)
        if not track or activity not in ("ReturningHome", "ReturningToArea", "FixingPosition"):
            return ""
        now, world = track[-1], self._scenario["world"]
        if activity == "FixingPosition":
            past = [turn for turn in self._turns[vehicle] if turn.time_s < at_s]
            ends_s = [turn.time_s for turn in past for row in turn.ended if activity in row["activities"]]
            places = [(row["x_m"], row["y_m"]) for row in _until(track, at_s, max(ends_s, default=-math.inf))]
            way_m, drift = math.fsum(starmap(distance, pairwise(places))), self._scenario["navigation"]["drift"]
            since = "last fix" if ends_s else "start"
            return f": {vehicle} had gone {way_m:.0f} m since its {since}, at a drift of {100.0 * drift:g} %"
        if activity == "ReturningToArea":
            sides = ((now[axis], *world[axis]) for axis in ("x_m", "y_m"))
            far_m = max(max(least - at_m, at_m - most) for at_m, least, most in sides)
            return f": {vehicle} was {far_m:.1f} m outside the area of operations"
        way_m, speed_mps = distance((now["x_m"], now["y_m"]), data["start_m"]), data["survey_speed_mps"]
        hotel_w = data["hotel_w"]
        if self._scenario["communication"].get("count_listening"):
            hotel_w += self._run.manifest.get("modem", {}).get("receive_w") or 0.0  # live, it is unknown
        survey_w = power_w(hotel_w, data["drag_w_per_mps3"], speed_mps)
        left_j, need_j = data["energy_j"] - now["energy_j"], HOME_MARGIN * survey_w * way_m / speed_mps
        text = f": of {data['energy_j'] / 1e3:.1f} kJ {vehicle} had {left_j / 1e3:.1f} kJ left, and the way home of"
        return f"{text} {way_m:.0f} m needs {need_j / 1e3:.1f} kJ, with a margin of {100.0 * (HOME_MARGIN - 1.0):.0f} %"

    def _satisfactions(self, vehicle: str, at_s: float, roles: Iterable[tuple[str, str]]) -> Iterator[Line]:
        rows = _until(self._rows("satisfaction")[vehicle], at_s)
        rows = _until(rows, at_s, math.nextafter(rows[-1]["time_s"], -math.inf)) if rows else []
        last = {(row["group"], row["role"]): row["value"] for row in rows}
        if values := [f"{last[role]} as {self._role(*role)}" for role in roles if role in last]:
            said_s = rows[-1]["time_s"]
            text = f"{vehicle}'s satisfaction, -128 to 127, was {listed(values)} in its slot at {_s(said_s)}."
            yield Line(text, said_s, vehicle)

    # Causes --------------------------------------------------------------------------------------

    def _causes(self, turn: Turn, seen: set[tuple[str, float]]) -> list[Line]:
        won = turn.main
        if won is not None and won["external"] > 0.0 and won["source"]:
            return self._signal(turn, won, seen)
        lines = list(self._ended(turn))
        if won is not None and won["role"]:
            lines = lines or self._occasion(turn, won)
            # Of the acts that began together, the one assigned last is the reason to begin now.
            acts = [act for act in (turn.begun or turn.decision.acts).values() if act["role"]]
            tasks = [task for act in acts if (task := self._task(turn.vehicle, act, turn.time_s))]
            tasks.sort(key=lambda task: -task[0].time_s)
            lines += tasks[0] if tasks else []
        return lines

    def _occasion(self, turn: Turn, won: Row) -> list[Line]:
        """Return the new step of the plan, and the fact, by which an objective gave an act its stimulus."""
        before = [row for row in (turn.before.rows if turn.before else []) if _is_of(row, won)]
        if not before or any(key_of(row) == key_of(won) and row["stimulus"] > 0.0 for row in before):
            return []
        vehicle, at_s = turn.vehicle, turn.time_s
        plans = _until(self._rows("plans")[vehicle], at_s, at_s - self._frame_s)
        steps = [row for row in plans if _is_of(row, won) and _is_step_of(row, won) and row["status"] == "running"]
        text = [f"{vehicle}'s step {row['task']} ran from {_s(row['time_s'])} on." for row in steps[-1:]]
        lines = [Line(one, steps[-1]["time_s"], vehicle) for one in text]
        return lines + (self._news(vehicle, at_s, won["argument"]) or self._news(vehicle, at_s))

    def _signal(self, turn: Turn, won: Row, seen: set[tuple[str, float]]) -> list[Line]:
        """Return the signal, or award of help, that moved a vehicle, and the causes of its sender's act."""
        vehicle, source, group, acts = turn.vehicle, won["source"], won["group"], won["activities"]
        roles = [row["role"] for row in turn.decision.rows if (row["group"], row["activities"]) == (group, acts)]
        sent = [row for row in self._packets if (row["slot"], row["sender"]) == (won["slot"], source)]
        heard = [(at_s, row) for row in sent if (at_s := _heard_s(row, vehicle)) is not None]
        if not heard:
            return [Line(f"{vehicle} answered {source}'s call at {_s(turn.time_s)}.", turn.time_s, vehicle)]
        heard_s, packet = heard[0]
        slot, sent_s, role = packet["slot"], packet["time_s"], ""
        what, value = "request for help", ""
        if calls := _calls(packet, group, roles):
            what, role = "signal", min(calls)[1]
            value = f": {min(calls)[0]} as {self._role(group, role)}{self._weaker(turn, source, group, roles)}"
        text = f"{vehicle} received {source}'s {what} at {_s(heard_s)} in slot {slot} of the run{value}."
        lines = [Line(text, heard_s, vehicle, slot)]
        decisions = _until(self._decisions[source], sent_s)
        doing = decisions[-1].acts if decisions else {}
        key = next((key for key in doing if key[:2] == (group, role)), None)
        text = f"{source} sent it at {_s(sent_s)}" + (f" while it performed {self._name(doing[key])}" if key else "")
        told = reversed(_until(self._rows("satisfaction")[source], sent_s))
        own = (row for row in told if (row["group"], row["role"]) == (group, role))
        low = [row["time_s"] for row in takewhile(lambda row: row["value"] < 0, own)]
        since = f", dissatisfied since {_s(low[-1])}" if low else ""
        lines.append(Line(f"{text}{since}.", sent_s, source, slot))
        began = [one for one in _until(self._turns[source], sent_s) if key in one.begun]
        if began and (source, began[-1].time_s) not in seen:
            at_s = began[-1].time_s
            text = f"{source} {self._text(began[-1])} at {_s(at_s)}{self._milestone(began[-1])}."
            lines += [Line(text, at_s, source), *self._causes(began[-1], seen | {(source, at_s)})]
        return lines

    def _weaker(self, turn: Turn, source: str, group: str, roles: Sequence[str]) -> str:
        """Return the other calls on the roles within the memory of signals: the last of each vehicle."""
        memory_s = self._frame_s * float(self._decision.get("signal_memory_frames", 1.0))
        last: dict[str, str] = {}
        for packet in _until(self._packets, turn.time_s, turn.time_s - memory_s):
            name, heard_s = packet["sender"], _heard_s(packet, turn.vehicle)
            if name != source and heard_s is not None and heard_s <= turn.time_s:
                calls = _calls(packet, group, roles)
                last[name] = f"{name}'s {min(calls)[0]} at {_s(heard_s)}" if calls else ""
        weaker = [text for text in last.values() if text]
        return f"; weaker: {listed(weaker)}" if weaker else ""

    def _ended(self, turn: Turn) -> Iterator[Line]:
        """Yield why an act ended: its plan or a step of it was over, or the vehicle left the role."""
        vehicle = turn.vehicle
        plans = _until(self._rows("plans")[vehicle], turn.time_s, turn.since_s)
        changes = _until(self._rows("organisation")[vehicle], turn.time_s, turn.since_s)
        lost = {(one["group"], one["role"]): one for one in changes if (one["event"], one["peer"]) == ("left", vehicle)}
        heirs = {
            (one["time_s"], one["group"], one["role"]): one["peer"] for one in changes if one["event"] == "assigned"
        }
        acts = [act for row in turn.ended for act in row["activities"]]
        for fault in _until(self._rows("faults")[vehicle], turn.time_s, max(turn.since_s, turn.time_s - self._frame_s)):
            if any(act in fault["detail"] for act in acts):
                text = f"{vehicle} noted at {_s(fault['time_s'])}: {fault['kind']}, {fault['detail']}."
                yield Line(text, fault["time_s"], vehicle)
        for row in turn.ended:
            role, task = self._role(row["group"], row["role"]), f"{row['objective']}({row['argument']})"
            over = [one for one in plans if _is_of(one, row) and one["status"] in OVER]
            whole = [one for one in over if one["node"] == 0]
            steps = [one for one in over if _is_step_of(one, row)]
            if whole or steps:
                end = (whole or steps)[-1]
                what = f"plan for {task}" if whole else f"step {end['task']} of {task}"
                how = f": {end['method']}" if end["method"] else ""
                text = f"{vehicle}'s {what} as {role} was {end['status']} at {_s(end['time_s'])}{how}."
                yield Line(text, end["time_s"], vehicle)
                yield from self._news(vehicle, turn.time_s, row["argument"])
                return
            if one := lost.get((row["group"], row["role"])):
                issuer, heir = one["issuer"] or "it", heirs.get((one["time_s"], row["group"], row["role"]))
                how = "decided" if heir is None else "took its place" if heir == issuer else f"gave it to {heir}"
                text = f"{vehicle} left the role {role} at {_s(one['time_s'])}, as {issuer} {how}."
                yield Line(text, one["time_s"], vehicle)
                return
        now = [key_of(row) for row in turn.decision.rows if row["stimulus"] > 0.0]
        if idle := [row for row in turn.ended if key_of(row) not in now]:
            text = f"{vehicle}'s {self._names(idle)} had no stimulus any more at {_s(turn.time_s)}."
            yield Line(text, turn.time_s, vehicle)

    def _news(self, vehicle: str, at_s: float, subject: str = "") -> list[Line]:
        """Return the rarest fact that a vehicle came to know in the last frame, on ``subject`` if given."""
        known = _until(self._known.get(vehicle, []), at_s, at_s - self._frame_s)
        meant = [one for one in known if subject in ("", one[1]["subject"])]
        if not meant:
            return []
        known_s, fact = min(meant, key=lambda one: (self._n_facts[one[1]["attribute"]], -one[0]))
        words = f"{fact['attribute']} of {fact['subject']} is {fact['value']}"
        return [self._reception(vehicle, known_s, fact, words)]

    def _task(self, vehicle: str, won: Row, by_s: float) -> list[Line]:
        """Return the assignment of the role of an act, and of its objective, the later first."""
        group, role, objective, argument = (won[name] for name in ("group", "role", "objective", "argument"))
        path, name = f"{group}.{role}", self._role(group, role)
        rows = _until(self._rows("organisation")[vehicle], by_s)
        rows = [row for row in rows if (row["group"], row["role"]) == (group, role)]
        given = [row for row in rows if (row["event"], row["peer"]) == ("assigned", vehicle)]
        aim = "given", objective, argument
        aimed = [row for row in rows if (row["event"], row["objective"], row["argument"]) == aim]
        words = f"{vehicle} plays {name}", f"{name} is for {objective}({argument})"
        found = [self._order(vehicle, row, (PLAYS, vehicle, path), words[0]) for row in given[-1:]]
        fact = f"{OBJECTIVE}{objective}", path, argument
        found += [self._order(vehicle, row, fact, words[1]) for row in aimed[-1:]]
        if len(found) == 2 and found[0].text.replace(words[0], words[1]) == found[1].text:
            return [found[0]._replace(text=found[0].text.replace(words[0], f"{words[0]} and {words[1]}"))]
        return sorted(found, key=lambda line: -line.time_s)

    def _order(self, vehicle: str, row: Row, fact: tuple[str, str, str], words: str) -> Line:
        """Return the line on a change of the organisation, with the item that told it."""
        issuer, from_s = row["issuer"], row["time_s"]
        if not issuer:
            return Line(f"Agreed before the mission: {words}.", from_s, vehicle)
        orders = _until(self._orders.get(vehicle, ()), from_s)
        stated = itemgetter("origin", "attribute", "subject", "value")
        known = [one for one in orders if stated(one[1]) == (issuer, *fact)]
        since = f", in effect at {_s(from_s)}"
        if not known:
            return Line(f"{issuer} decided that {words}{since}.", from_s, vehicle)
        known_s, item = known[-1]
        return self._reception(vehicle, known_s, item, words, since, "decided")

    def _reception(
        self, vehicle: str, known_s: float, fact: Row, words: str, more: str = "", verb: str = "recorded"
    ) -> Line:
        """Return the line on an item: its origin, and how the vehicle came to know it."""
        origin, slot = fact["origin"], None
        text = f"{origin} {verb} at {_s(fact['recorded_s'])} that {words}"
        if origin != vehicle:
            sent = _until(self._packets, known_s, fact["recorded_s"] - self._frame_s)
            carriers = [one for one in sent if fact["uid"] in one["item_uids"]]
            if packet := next((one for one in carriers if _heard_s(one, vehicle) == known_s), None):
                slot, lost = packet["slot"], [one for one in carriers if _heard_s(one, vehicle) is None]
                text += f"; {packet['sender']} sent it at {_s(packet['time_s'])} in slot {slot} of the run"
                text += f", {len(lost)} lost since {_s(lost[0]['time_s'])}" if lost else ""
            text += f"; {vehicle} received it at {_s(known_s)}"
        return Line(f"{text}{more}.", known_s, vehicle, slot)

    # Alternatives --------------------------------------------------------------------------------

    def _rejection(self, vehicle: str, at_s: float, name: str) -> Line:
        """Return why a vehicle did not perform a role or activity; OutputError for an unknown one."""
        weighed = [row for of in self._decisions.values() for one in of for row in one.rows]
        roles = [*self._roles]
        activities = dict.fromkeys(activity for row in weighed for activity in row["activities"])
        known = list(dict.fromkeys([*(role for _, role in roles), *activities]))
        paths = [".".join(role) for role in roles]
        if name not in {*known, *paths}:
            near = suggestion(name, [*known, *paths])
            raise OutputError(f"no role or activity {name!r}; there are {', '.join(known)}{near}")

        def is_meant(row: Row) -> bool:
            return name in (row["role"], f"{row['group']}.{row['role']}", *row["activities"])

        decisions = _until(self._decisions[vehicle], at_s)
        rows = [row for row in decisions[-1].rows if is_meant(row)] if decisions else []
        begins_s = [turn.time_s for turn in self._turns[vehicle] if any(map(is_meant, turn.begun.values()))]
        later_s = [begin_s for begin_s in begins_s if begin_s > at_s]
        begun = f"it began it at {_s(later_s[0])}" if later_s else "it never began it in this run"
        if begins_s and not later_s:
            begun = f"it last began it at {_s(begins_s[-1])}"
        places = [role for role in roles if name in (role[1], ".".join(role))]
        places = places or [(row["group"], row["role"]) for row in weighed if is_meant(row) and row["role"]]
        if self._away(vehicle, at_s)[1]:
            reason = f"{vehicle} was out of the mission at {_s(at_s)}"
        elif did := [row for row in rows if row["chosen"]]:
            reason = f"{vehicle} did perform {self._names(did)} then"
        elif rows:
            reason = self._lost(decisions[-1], _best(rows) or rows[0], vehicle)
        else:
            past = next((row for one in reversed(decisions) for row in one.rows if is_meant(row)), None)
            reason = self._not_held(vehicle, at_s, dict.fromkeys(places)) + self._plan(vehicle, past, at_s)
        return Line(f"Not {name}: {reason}; {begun}.", at_s, vehicle)

    def _lost(self, decision: Decision, lost: Row, vehicle: str) -> str:
        """Return why a candidate was not chosen."""
        at_s, acts = decision.time_s, decision.acts.values()
        won = next((row for row in acts if not row["role"]), _best(acts))
        if lost["stimulus"] <= 0.0:
            return f"{self._name(lost)} had no stimulus at {_s(at_s)}{self._plan(vehicle, lost, at_s)}"
        mean = _mean(lost) or (", in no valid combination" if motivation_of(lost) else "")
        text = f"{self._name(lost)} had motivation {_value(lost)}{mean} at {_s(at_s)}"
        if won is None:
            return text
        first = f"{_value(won)}{_mean(won)}" if won["role"] else "precedence, as it is vital"
        return f"{text}, {self._name(won)} had {first}"

    def _plan(self, vehicle: str, row: Row | None, at_s: float) -> str:
        """Return the state of the plan for an objective; empty without one."""
        plans = _until(self._rows("plans")[vehicle], at_s)
        own = [one for one in plans if row and _is_of(one, row) and one["node"] == 0]
        if not own:
            return ""
        how = f" ({own[-1]['method']})" if own[-1]["method"] else ""
        return f"; its plan was {own[-1]['status']}{how} since {_s(own[-1]['time_s'])}"

    def _not_held(self, vehicle: str, at_s: float, places: Iterable[tuple[str, str]]) -> str:
        """Return why a vehicle weighed no activity of these roles."""
        held: dict[tuple[str, str], dict[str, None]] = defaultdict(dict)
        rows = _until(self._rows("organisation")[vehicle], at_s)
        for row in rows:
            if row["event"] == "assigned":
                held[row["group"], row["role"]][row["peer"]] = None
            elif row["event"] == "left":
                held[row["group"], row["role"]].pop(row["peer"], None)
        if own := [self._role(*place) for place in places if vehicle in held[place]]:
            return f"{vehicle} held {listed(own)}, without a candidate for it at {_s(at_s)}"
        names, groups = [self._role(*place) for place in places], {group: None for group, _ in places}
        reasons = [f"{vehicle} did not hold {' or '.join(names)} at {_s(at_s)}"]
        if not any(vehicle in holders for (group, _), holders in held.items() if group in groups):
            reasons.append(f"it was not in the group {' or '.join(groups)}")
        allowed = next((one.get("playable_roles") for one in self._scenario["vehicle"] if one["name"] == vehicle), None)
        if allowed is not None and not any({role, f"{group}.{role}"} & {*allowed} for group, role in places):
            reasons.append(f"it was not eligible, its playable_roles are {listed(allowed)}")
        refused = [row for row in rows if row["outcome"] != "success" and row["peer"] == vehicle]
        refused = [row for row in refused if (row["group"], row["role"]) in places]
        reasons += [f"refused at {_s(row['time_s'])}: {row['outcome']}" for row in refused[-1:]]
        for place in places:
            most = f", its maximum of {self._roles[place]}" if self._roles[place] == len(held[place]) else ""
            view = f"in {vehicle}'s view {listed([*held[place]])} held"
            reasons += [f"{view} {self._role(*place)}{most}"] if held[place] else []
        return "; ".join(reasons)

    # Names ---------------------------------------------------------------------------------------

    @cached_property  # asked for each name
    def _shared(self) -> set[str]:
        """Role names of several groups."""
        names = [role for _, role in self._roles]
        return {name for name in names if names.count(name) > 1}

    @cached_property
    def _roles(self) -> dict[tuple[str, str], int | None]:
        """Groups and roles, declared or performed, with their maximum of holders."""
        groups = self._scenario.get("group", ())
        acts = (key for turns in self._turns.values() for turn in turns for key in turn.decision.acts if key[1])
        declared = {(group["name"], role["name"]): role.get("maximum") for group in groups for role in group["role"]}
        return {(key[0], key[1]): None for key in acts} | declared

    def _role(self, group: str, role: str) -> str:
        return f"{group}.{role}" if role in self._shared else role

    def _name(self, row: Row) -> str:
        acts = " + ".join(row["activities"])
        return f"{acts} ({self._role(row['group'], row['role'])})" if row["role"] else acts

    def _names(self, rows: Iterable[Row]) -> str:
        return listed([self._name(row) for row in rows])

    # Tables, each read once for all answers ------------------------------------------------------

    def _rows(self, table: str) -> Mapping[str, list[Row]]:
        """Return the rows of a table by vehicle."""
        if table not in self._read:
            self._read[table] = _by(self._run.rows(table), "vehicle")
        return self._read[table]

    @cached_property
    def _packets(self) -> Sequence[Row]:
        return self._run.rows("packets")

    @cached_property
    def _frame_s(self) -> float:
        """Time in which news lead to a decision: a TDMA frame, at least a period of decisions."""
        ends = [(row["slot"], row["time_s"]) for row in (*self._packets[:1], *self._packets[-1:])]
        slots = ends[-1][0] - ends[0][0] if ends else 0
        slot_s = (ends[-1][1] - ends[0][1]) / slots if slots else 0.0
        return float(max(len(self.vehicles) * slot_s, self._decision.get("period_s", 0.0)))

    @cached_property
    def _known(self) -> Mapping[str, list[tuple[float, Row]]]:
        """Facts by the vehicle that knew them, in time order: its own, those received; all, with instant sharing."""
        found: dict[str, list[tuple[float, Row]]] = defaultdict(list)
        items = _by((row for row in self._run.rows("items") if row["kind"] != "status"), "uid")
        for row in (fact for facts in items.values() for fact in facts):
            is_shared = not self._packets and row["kind"] == "told"
            for name in self.vehicles if is_shared else [row["origin"]]:
                found[name].append((row["recorded_s"], row))
        for row in self._run.rows("knowledge"):
            if row["event"] == "received":
                found[row["vehicle"]] += [(row["time_s"], fact) for fact in items[row["item"]]]
        for known in found.values():
            known.sort(key=_time_s)
        return found

    @cached_property
    def _orders(self) -> Mapping[str, list[tuple[float, Row]]]:
        """Facts on roles and objectives, as ``_known``."""
        return {
            name: [one for one in known if one[1]["attribute"].startswith((PLAYS, OBJECTIVE))]
            for name, known in self._known.items()
        }

    @cached_property
    def _n_facts(self) -> Counter[str]:
        return Counter(row["attribute"] for row in self._run.rows("items"))


# Rows ---------------------------------------------------------------------------------------------


def _by(rows: Iterable[Row], column: str) -> Mapping[str, list[Row]]:
    found: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        found[row[column]].append(row)
    return found


def _until(rows: Sequence[Any], until_s: float, after_s: float = -math.inf) -> Sequence[Any]:
    """Return the rows, in time order, after ``after_s`` and by ``until_s``."""
    return rows[bisect_right(rows, after_s, key=_time_s) : bisect_right(rows, until_s, key=_time_s)]


def _time_s(row: Any) -> float:
    time_s: float = row["time_s"] if isinstance(row, Mapping) else getattr(row, "time_s", row[0])
    return time_s


def _value(row: Row) -> str:
    return f"{motivation_of(row):.2f}" if motivation_of(row) else "0.00 (importance 0)"


def _best(rows: Iterable[Row]) -> Row | None:
    """Return the candidate with a stimulus whose best combination has the highest mean; None without one."""
    moved = [row for row in rows if row["stimulus"] > 0.0]
    return max(
        moved, key=lambda row: (bool(motivation_of(row)), row["best_mean"] or 0.0, motivation_of(row)), default=None
    )


def _mean(row: Row) -> str:
    return "" if row["best_mean"] is None else f", in a combination of mean motivation {row['best_mean']:.4f}"


def _is_of(plan: Row, row: Row) -> bool:
    """True for two rows about one objective of a role."""
    return all(plan[name] == row[name] for name in ("group", "role", "objective", "argument"))


def _is_step_of(plan: Row, row: Row) -> bool:
    return plan["task"].partition("(")[0] in row["activities"]


def _heard_s(packet: Row, vehicle: str) -> float | None:
    return dict(zip(packet["receivers"], packet["arrivals_s"], strict=True)).get(vehicle)


def _calls(packet: Row, group: str, roles: Sequence[str]) -> list[tuple[int, str]]:
    """Return value and role of the negative influence signals of a packet that address one of the roles."""
    signals = zip(packet["signal_roles"], packet["signal_addressed"], packet["signal_values"], strict=True)
    paths = [f"{group}.{role}" for role in roles]
    return [(value, of.partition(".")[2]) for of, to, value in signals if to in paths and value < 0]


def _s(time_s: float) -> str:
    return f"{time_s:.1f} s"
