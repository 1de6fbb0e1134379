"""Faults planted in the code, at least one per invariant: a mechanism is removed or inverted.

Each is to be named by the invariant that is about it. ``needs`` are kinds without which it has nothing to do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from exchange.manager import manager, receiver
from exchange.manager.beliefs import Beliefs
from exchange.manager.peers import PeerStates
from exchange.wire.definitions import N_AT_ONCE, ComparedDefinitions, Introductions
from exchange.wire.sealing import Checksum
from missions.meeting.meeting import Meeting
from missions.meeting.truth import MeetingTruth
from missions.runs import assembly
from remoras import authority, motion
from remoras.database import VehicleData
from remoras.fleet import radio, vehicle
from remoras.fleet.radio import Jumps
from remoras.functional.layer import Sensing
from remoras.motion import Motion
from remoras.motion.separation import Separation
from remoras.social import consultation
from worldmodel.facts import Merged
from worldmodel.store import Store

Patch = pytest.MonkeyPatch
Plant = Callable[[Patch], None]


class Planted(NamedTuple):
    """A fault in the code.

    Attributes:
        invariant: that is to name it; plant: plants it; needs: kinds of which one is needed.
        once: file of the schedule in ``tests/faults`` by which it was found, if the program once had it; then that one
            schedule has to name it.
    """

    invariant: str
    plant: Plant
    needs: frozenset[str] = frozenset()
    once: str = ""


REAL_MERGE, REAL_WORLD_MODEL = radio.merge, assembly.world_model
REAL_MOVE = motion._move


def raise_at_a_jump(patch: Patch) -> None:
    sound = Jumps.suspected

    def suspected(self: Jumps, block: Any) -> Any:
        return 1 // 0 if sound(self, block) else ""

    patch.setattr(Jumps, "suspected", suspected)


def believe_that_all_hold_what_is_new_here(patch: Patch) -> None:
    add = Beliefs.add

    def added(self: Beliefs, *item: Any) -> int:
        column = add(self, *item)
        self.held = [items | 1 << column for items in self.held]
        return column

    patch.setattr(Beliefs, "add", added)


def shift_what_is_merged(patch: Patch) -> None:
    def merge(model: Any, blocks: Any, now_s: float, checked: bool) -> Merged:
        shifted = [one._replace(time_s=max(0.0, one.time_s - 0.1)) if now_s > 100.0 else one for one in blocks]
        return REAL_MERGE(model, shifted, now_s, checked)

    patch.setattr(radio, "merge", merge)


def merge_all_facts_but_the_last(patch: Patch) -> None:
    def merge(model: Any, blocks: Any, now_s: float, checked: bool) -> Merged:
        return REAL_MERGE(model, [one._replace(facts=one.facts[:-1] or one.facts) for one in blocks], now_s, checked)

    patch.setattr(radio, "merge", merge)


def forget_at_a_restart(patch: Patch) -> None:
    def remember(model: Any, kept: Any, now_s: float) -> Merged:
        return REAL_MERGE(model, [block for _, block in kept.items() if block is not None][::2], now_s)

    patch.setattr(vehicle, "remember", remember)


def take_the_future(patch: Patch) -> None:
    patch.setattr(Store, "latest_time_s", lambda self, now_s: math.inf)


def drop_other_content(patch: Patch) -> None:
    patch.setattr(receiver, "_contradiction", lambda *rest: None)


def check_no_checksum(patch: Patch) -> None:
    patch.setattr(Checksum, "stripped", lambda self, data, frame: data[: len(data) - self.size_bits // 8])


def close_what_one_peer_holds(patch: Patch) -> None:
    def lacked(self: Beliefs, items: int) -> int:
        for node, held in enumerate(self.held):
            items &= -1 if node == self.me else ~held
        return items

    patch.setattr(Beliefs, "lacked", lacked)


def never_park(patch: Patch) -> None:
    patch.setattr(PeerStates, "mark_absent", lambda self, frame: [])


def grant_everything(patch: Patch) -> None:
    patch.setattr(consultation, "may_assign", lambda asked, *rest: authority.Outcome.SUCCESS)


def let_no_head_step_down(patch: Patch) -> None:
    sound = consultation._hand_over
    patch.setattr(consultation, "_hand_over", lambda view, to, holders, *rest: sound(view, to, (), *rest))


def count_what_the_first_uses_alone(patch: Patch) -> None:
    def move(of: Motion, data: VehicleData, *rest: Any) -> None:
        before_j = of.energy_j
        REAL_MOVE(of, data, *rest)
        if data.node:
            of.energy_j = before_j

    patch.setattr(motion, "_move", move)


def let_the_older_of_two_count(patch: Patch) -> None:
    sound = Store.latest

    def latest(self: Store, subject: int, attribute: int) -> Any:
        past = tuple(self.history(subject, attribute))
        return past[0] if len(past) == 2 else sound(self, subject, attribute)

    patch.setattr(Store, "latest", latest)


def see_nobody(patch: Patch) -> None:
    patch.setattr(Separation, "look", lambda self: {})


def wait_for_who_is_elsewhere(patch: Patch) -> None:
    patch.setattr(Meeting, "is_overdue", lambda self, *rest: False)


def begin_anew_as_known(patch: Patch) -> None:
    patch.setattr(assembly, "world_model", lambda setup, node, epoch=0: REAL_WORLD_MODEL(setup, node))


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


PLANTS = (
    Planted("exceptions", raise_at_a_jump, frozenset({"misplaced"})),
    Planted("beliefs", believe_that_all_hold_what_is_new_here),
    Planted("recorded", shift_what_is_merged),
    Planted("recorded", merge_all_facts_but_the_last),
    Planted("remembered", forget_at_a_restart, frozenset({"restarts"})),
    Planted("one-content", drop_other_content, once="mangled-first-copy"),
    Planted("past", take_the_future, once="fact-of-the-future"),
    Planted("sound-packets", check_no_checksum, once="damaged-packets-pass"),
    Planted("agreement", close_what_one_peer_holds, frozenset({"deaf", "partition", "loss"})),
    Planted("rest", never_park, frozenset({"lost"})),
    Planted("authority", grant_everything, frozenset({"forged-role", "forged-objective"})),
    Planted("cardinality", let_no_head_step_down, frozenset({"mute", "partition", "lost"})),
    Planted("follows", count_what_the_first_uses_alone),
    Planted("newest", let_the_older_of_two_count),
    Planted("separation", see_nobody),
    Planted("ends", never_meet),
    Planted("follows", map_with_dead_sensors, once="dead-sensor-maps"),
    Planted("finishes", wait_for_who_is_elsewhere, once="meeting-waits-for-a-lie"),
    Planted("beliefs", begin_anew_as_known, once="restart-taken-for-known"),
)


def believe_what_anybody_may_write(patch: Patch) -> None:
    """The clear first byte makes strangers, noise makes introductions due, and these keep to frames of one parity."""

    def may_go(self: Introductions, frame: int) -> bool:
        return len(self._made) < N_AT_ONCE or frame >= self._made[-1] + 2

    patch.setattr(manager, "ProvenDefinitions", ComparedDefinitions)
    patch.setattr(Introductions, "miss", lambda self, node: setattr(self, "_is_due", True))
    patch.setattr(Introductions, "_may_go", may_go)
