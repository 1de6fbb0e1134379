"""Faults planted in the code, one for each invariant: a mechanism is taken out or turned round.

Each is to be named, by the invariant that is about it, from seeds alone. ``needs`` are kinds without which the
mechanism has nothing to do: seeds whose schedules have none of them are passed over, which takes no run.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pytest
from stress.schedules import KINDS

from exchange import manager
from exchange.peering import listening
from exchange.peering.holders import Holders
from exchange.peering.listening import Listener
from exchange.peering.parking import Parking
from exchange.wire.definitions import N_AT_ONCE, ComparedDefinitions, Introductions
from exchange.wire.sealing import Checksum
from missions.mapping.behaviours import ZigzagExploring
from missions.mapping.truth import MappingTruth
from missions.meeting.meeting import Meeting
from missions.meeting.truth import MeetingTruth
from missions.runs import assembly, metrics
from remoras import authority, motion, radio, traffic, vehicle
from remoras.behaviours import CAPTURE_M, Homing, Reference
from remoras.contents import Content
from remoras.current import Current
from remoras.database import VehicleData
from remoras.executive.decision import Choice
from remoras.fault_events import FaultChanges
from remoras.fleet import Fleet
from remoras.functional.layer import FunctionalLayer
from remoras.functional.sensing import Sensing
from remoras.jumps import Jumps
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.radio import Radio
from remoras.run_log import RunLog
from remoras.separation import Separation
from remoras.social import consultation
from remoras.social.leadership import Leadership
from remoras.social.standing import Standing
from remoras.strategies.dispatch import Dispatcher
from remoras.strategy import Move, Situation
from worldmodel.facts import Merged
from worldmodel.store import Store

Patch = pytest.MonkeyPatch
Plant = Callable[[Patch], None]


class Planted(NamedTuple):
    """A fault in the code.

    Attributes:
        invariant: that is to name it; plant: plants it; needs: kinds of which one is needed.
        kinds: that are drawn beside; settings: of the small mission.
        once: file of the schedule in ``tests/faults`` by which it was found, if the program once had it.
    """

    invariant: str
    plant: Plant
    needs: frozenset[str] = frozenset()
    kinds: tuple[str, ...] = tuple(KINDS)
    settings: tuple[str, ...] = ()
    once: str = ""


CHECKED = ("communication.crc_bits=32",)
REAL_MERGE, REAL_EMBODY, REAL_WORLD_MODEL = radio.merge, vehicle.embody, assembly.world_model
REAL_MOVE = motion._move
N_CALLS = itertools.count()


def raise_at_a_jump(patch: Patch) -> None:
    sound = Jumps.suspected

    def suspected(self: Jumps, block: Any) -> Any:
        jump = sound(self, block)
        return None if jump is None else 1 // 0

    patch.setattr(Jumps, "suspected", suspected)


def believe_that_all_hold_what_is_new_here(patch: Patch) -> None:
    def take(self: Holders, column: int) -> None:
        for node in range(len(self._state.believes)):
            self._state.believes[node] |= 1 << column

    patch.setattr(Holders, "take", take)


def shift_what_is_merged(patch: Patch) -> None:
    def merge(model: Any, blocks: Any, now_s: float, judged: bool) -> Merged:
        shifted = [one._replace(time_s=max(0.0, one.time_s - 0.1)) if now_s > 100.0 else one for one in blocks]
        return REAL_MERGE(model, shifted, now_s, judged)

    patch.setattr(radio, "merge", merge)


def merge_all_facts_but_the_last(patch: Patch) -> None:
    def merge(model: Any, blocks: Any, now_s: float, judged: bool) -> Merged:
        return REAL_MERGE(model, [one._replace(facts=one.facts[:-1] or one.facts) for one in blocks], now_s, judged)

    patch.setattr(radio, "merge", merge)


def forget_at_a_restart(patch: Patch) -> None:
    def remember(model: Any, kept: Any, now_s: float) -> Merged:
        return REAL_MERGE(model, [block for _, block in kept.items() if block is not None][::2], now_s)

    patch.setattr(vehicle, "remember", remember)


def take_the_future(patch: Patch) -> None:
    patch.setattr(manager, "_refuse_future", lambda packet, now_s, model: None)
    patch.setattr(Store, "latest_time_s", lambda self, now_s: math.inf)


def drop_other_content(patch: Patch) -> None:
    patch.setattr(listening, "_contradiction", lambda *rest: None)


def check_no_checksum(patch: Patch) -> None:
    patch.setattr(Checksum, "stripped", lambda self, data, frame: data[: len(data) - self.size_bits // 8])


def never_catch_up(patch: Patch) -> None:
    patch.setattr(Listener, "_catch_up", lambda self, now_s: None)
    patch.setattr(Listener, "reopen", lambda self, now_s: None)


def never_park(patch: Patch) -> None:
    patch.setattr(Parking, "look", lambda self, frame, now_s: ())


def grant_everything(patch: Patch) -> None:
    patch.setattr(consultation, "may_assign", lambda asked, *rest: authority.Outcome.SUCCESS)


def obey_whoever_claims(patch: Patch) -> None:
    patch.setattr(Leadership, "_heads_against", lambda self, *rest: set())


def let_no_head_step_down(patch: Patch) -> None:
    sound = consultation._hand_over
    patch.setattr(consultation, "_hand_over", lambda view, to, holders, *rest: sound(view, to, (), *rest))


def divide_by_nothing(patch: Patch) -> None:
    sound = FunctionalLayer.impair

    def impair(self: FunctionalLayer, speed_factor: float, *rest: Any) -> None:
        sound(self, speed_factor, *rest)
        if speed_factor < 1.0:
            self.motion.speed_mps = math.nan

    patch.setattr(FunctionalLayer, "impair", impair)


def begin_anew_elsewhere(east_m: float) -> Callable[[Patch], None]:
    def plant(patch: Patch) -> None:
        def embody(layer: FunctionalLayer, before: FunctionalLayer) -> None:
            REAL_EMBODY(layer, before)
            layer.motion.x_m += east_m

        patch.setattr(vehicle, "embody", embody)

    return plant


def begin_anew_charged(patch: Patch) -> None:
    def embody(layer: FunctionalLayer, before: FunctionalLayer) -> None:
        REAL_EMBODY(layer, before)
        layer.motion.energy_j = 0.0

    patch.setattr(vehicle, "embody", embody)


def count_what_the_first_uses_alone(patch: Patch) -> None:
    def move(of: Motion, data: VehicleData, *rest: Any) -> None:
        before_j = of.energy_j
        REAL_MOVE(of, data, *rest)
        if data.node:
            of.energy_j = before_j

    patch.setattr(motion, "_move", move)


def turn_at_once(patch: Patch) -> None:
    patch.setattr(motion, "_turn", lambda most_rad: (-2.0, 0.0))


def let_the_older_of_two_count(patch: Patch) -> None:
    sound = Store.latest

    def latest(self: Store, subject: int, attribute: int, at_s: float | None = None) -> Any:
        past = tuple(self.history(subject, attribute))
        return past[0] if len(past) == 2 and at_s is None else sound(self, subject, attribute, at_s)

    patch.setattr(Store, "latest", latest)


def forget_a_reception(patch: Patch) -> None:
    sound = Radio._record_item

    def record(self: Radio, now_s: float, uid: Any, event: str) -> None:
        if event != "received" or uid.sequence % 10 != 9:
            sound(self, now_s, uid, event)

    patch.setattr(Radio, "_record_item", record)


def forget_a_tick(patch: Patch) -> None:
    sound = Fleet._record

    def record(self: Fleet, now_s: float) -> None:
        sound(self, now_s)
        if now_s == 99.0:
            self.recorder.trajectories.new.pop()

    patch.setattr(Fleet, "_record", record)


def forget_that_roles_were_left(patch: Patch) -> None:
    sound = RunLog.roles

    def roles(self: RunLog, now_s: float, roles: Any, event: str) -> None:
        sound(self, now_s, () if event == "left" else roles, event)

    patch.setattr(RunLog, "roles", roles)


def forget_that_faults_were_over(patch: Patch) -> None:
    sound = FaultChanges.act

    def act(self: FaultChanges, host: Any) -> None:
        sound(self, host)
        if not self.begins:
            host.recorder.faults.new.pop()

    patch.setattr(FaultChanges, "act", act)


def let_the_deaf_hear(patch: Patch) -> None:
    patch.setattr(traffic, "hears_throughout", lambda *rest: True)


def leave_out_the_longest_wait(patch: Patch) -> None:
    sound = metrics.latencies_s
    patch.setattr(metrics, "latencies_s", lambda recorder: sound(recorder)[:-1])


def count_a_byte_less_of_headers(patch: Patch) -> None:
    sound = radio.Radio._count_bits

    def count(self: radio.Radio, sent: Any) -> None:
        sound(self, sent)
        self._bits[Content.HEADERS] -= 8

    patch.setattr(radio.Radio, "_count_bits", count)


def see_nobody(patch: Patch) -> None:
    patch.setattr(Separation, "look", lambda self: {})


def complete_before_the_meeting(patch: Patch) -> None:
    sound = MappingTruth.observe

    def observe(self: MappingTruth, view: Any, now_s: float) -> bool:
        return sound(self, view, now_s) or self.goal_fraction >= 1.0

    patch.setattr(MappingTruth, "observe", observe)


def complete_a_while_ago(patch: Patch) -> None:
    sound = MeetingTruth.observe

    def observe(self: MeetingTruth, view: Any, now_s: float) -> bool:
        is_complete = sound(self, view, now_s)
        if is_complete:
            self.milestones[-1] = replace(self.milestones[-1], time_s=now_s - 5.0)
        return is_complete

    patch.setattr(MeetingTruth, "observe", observe)


def count_bytes_twice(patch: Patch) -> None:
    sound = metrics.n_bits
    patch.setattr(metrics, "n_bits", lambda run: sound(run) + 8 * len(run.recorder.refused))


def claim_nothing(patch: Patch) -> None:
    patch.setattr(Standing, "claims", lambda self: [])


def keep_count_between_runs(patch: Patch) -> None:
    sound = Radio.tidy

    def tidy(self: Radio, now_s: float) -> None:
        self._record_fault(now_s, "call", str(next(N_CALLS)))
        sound(self, now_s)

    patch.setattr(Radio, "tidy", tidy)


def wait_for_who_is_elsewhere(patch: Patch) -> None:
    patch.setattr(Meeting, "is_overdue", lambda self, *rest: False)


def begin_anew_as_known(patch: Patch) -> None:
    patch.setattr(assembly, "world_model", lambda setup, node, epoch=0: REAL_WORLD_MODEL(setup, node))


def meet_without_who_is_away(patch: Patch) -> None:
    patch.setattr(MeetingTruth, "_has_come", lambda self, vehicle, group: True)


def map_with_dead_sensors(patch: Patch) -> None:
    sound = Sensing.look

    def look(self: Sensing, *rest: Any) -> Any:
        found = sound(self, *rest)
        self.looking = tuple(name for name, _ in self._on)
        return found

    patch.setattr(Sensing, "look", look)


def never_meet(patch: Patch) -> None:
    patch.setattr(MeetingTruth, "_is_together", lambda self, survivors, group: False)
    patch.setattr(MeetingTruth, "_is_overdue", lambda self, survivors, group, now_s: False)


def let_the_water_run_west(patch: Patch) -> None:
    sound = Current.at

    def at(self: Current, depth_m: float, now_s: float) -> tuple[float, float]:
        east_mps, north_mps = sound(self, depth_m, now_s)
        return -east_mps, north_mps

    patch.setattr(Current, "at", at)


def take_the_90_for_the_95(patch: Patch) -> None:
    sound = metrics.quantile
    patch.setattr(metrics, "quantile", lambda ordered, share: sound(ordered, 0.9 if share == 0.95 else share))


def call_items_known_to_all_a_second_early(patch: Patch) -> None:
    sound = metrics.consistency

    def consistency(*given: Any) -> tuple[float | None, float | None]:
        mean_s, share = sound(*given)
        return (None if mean_s is None else mean_s - 1.0), share

    patch.setattr(metrics, "consistency", consistency)


def say_that_references_hold(behaviour: type[Any]) -> Callable[[Patch], None]:
    """It slows down 10 m before its target, and says that the reference holds all the way."""

    def plant(patch: Patch) -> None:
        sound = behaviour.reference

        def reference(self: Any, motion: Motion, picture: Picture) -> Reference | None:
            found: Reference | None = sound(self, motion, picture)
            if found is None or found.holds_m > 100.0:
                return found
            to_go_m = abs(found.target_m[0] - motion.x_m) + abs(found.target_m[1] - motion.y_m)
            return found._replace(speed_mps=found.speed_mps * (0.9 if to_go_m < 10.0 else 1.0), holds_m=CAPTURE_M)

        patch.setattr(behaviour, "reference", reference)

    return plant


def stick_to_the_first_decision(patch: Patch) -> None:
    def best(self: Choice, motivations: Sequence[float]) -> tuple[int, ...]:
        found: tuple[int, ...] = self.__dict__.setdefault("found", self.searched(motivations))
        return found

    patch.setattr(Choice, "best", best)


def let_moves_stand_until_news(patch: Patch) -> None:
    sound = Dispatcher.negotiate

    def negotiate(self: Dispatcher, situation: Situation) -> Move:
        return replace(sound(self, situation), until_news=True, holding=bool(situation.round % 7))

    patch.setattr(Dispatcher, "negotiate", negotiate)


PLANTS = (
    Planted("exceptions", raise_at_a_jump, frozenset({"misplaced"})),
    Planted("beliefs", believe_that_all_hold_what_is_new_here),
    Planted("recorded", shift_what_is_merged),
    Planted("whole-blocks", merge_all_facts_but_the_last),
    Planted("remembered", forget_at_a_restart, frozenset({"restarts"})),
    Planted(
        "one-content",
        drop_other_content,
        frozenset({"bits", "forged"}),
        ("bits", "cut", "forged"),
        once="mangled-first-copy",
    ),
    Planted("past", take_the_future, frozenset({"forged"}), once="fact-of-the-future"),
    Planted("sound-packets", check_no_checksum, frozenset({"bits"}), settings=CHECKED, once="damaged-packets-pass"),
    Planted("agreement", never_catch_up, frozenset({"deaf", "partition", "restarts", "lost"})),
    Planted("rest", never_park, frozenset({"lost"})),
    Planted("authority", grant_everything, frozenset({"forged-role", "forged-objective"})),
    Planted("authority", obey_whoever_claims, frozenset({"forged-lead"})),
    Planted("cardinality", let_no_head_step_down, frozenset({"mute", "partition", "lost"})),
    Planted("finite", divide_by_nothing, frozenset({"slow"})),
    Planted("follows", begin_anew_elsewhere(5000.0), frozenset({"restarts"})),
    Planted("follows", begin_anew_elsewhere(50.0), frozenset({"restarts"})),
    Planted("follows", begin_anew_charged, frozenset({"restarts"})),
    Planted("follows", count_what_the_first_uses_alone),
    Planted("follows", turn_at_once),
    Planted("follows", let_the_water_run_west, settings=("current.east_mps=0.2",)),
    Planted("follows", take_the_90_for_the_95),
    Planted("newest", let_the_older_of_two_count),
    Planted("follows", forget_a_reception),
    Planted("follows", forget_a_tick),
    Planted("follows", forget_that_roles_were_left, frozenset({"lost"})),
    Planted("follows", forget_that_faults_were_over, frozenset({"deaf", "mute", "slow"})),
    Planted("follows", let_the_deaf_hear, frozenset({"deaf"})),
    Planted("follows", leave_out_the_longest_wait),
    Planted("follows", count_a_byte_less_of_headers),
    Planted("follows", call_items_known_to_all_a_second_early),
    Planted("separation", see_nobody),
    Planted("follows", complete_before_the_meeting),
    Planted("follows", complete_a_while_ago),
    Planted("follows", count_bytes_twice, frozenset({"cut", "bits", "late", "twice"})),
    Planted("finishes", claim_nothing, frozenset({"lost"})),
    Planted("ends", never_meet),
    Planted("repeats", keep_count_between_runs),
    Planted("follows", meet_without_who_is_away, frozenset({"partition"})),
    Planted("follows", map_with_dead_sensors, frozenset({"sensor"}), once="dead-sensor-maps"),
    Planted("finishes", wait_for_who_is_elsewhere, frozenset({"misplaced"}), once="meeting-waits-for-a-lie"),
    Planted("beliefs", begin_anew_as_known, frozenset({"restarts"}), once="restart-taken-for-known"),
    Planted("answers", say_that_references_hold(ZigzagExploring)),
    Planted("answers", say_that_references_hold(Homing)),
    Planted("answers", stick_to_the_first_decision),
    Planted("answers", let_moves_stand_until_news),
)


def believe_what_anybody_may_write(patch: Patch) -> None:
    """The clear first byte makes strangers, noise makes introductions due, and these keep to frames of one parity."""

    def may_go(self: Introductions, frame: int) -> bool:
        return len(self._made) < N_AT_ONCE or frame >= self._made[-1] + 2

    patch.setattr(manager, "ProvenDefinitions", ComparedDefinitions)
    patch.setattr(Introductions, "miss", lambda self, node: setattr(self, "_is_due", True))
    patch.setattr(Introductions, "_may_go", may_go)
