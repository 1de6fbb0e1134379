"""Conformance check of behaviours, raising ``AssertionError`` with fault, moment and value."""

import copy
import math
import pickle
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

from remoras.behaviours import IDLE, Behaviour, Perception, Reference, basis, distance_m
from remoras.database import VehicleData
from remoras.fleet.radio import note_position
from remoras.functional.layer import ROUNDING
from remoras.motion import Motion
from remoras.picture import Body, Groups, Picture
from remoras.sensor import Observation


def passed(checks: Iterable[Callable[..., None]], *plugin: Any) -> Iterator[str]:
    """Run the checks of a plug-in and yield their names."""
    for check_one in checks:
        check_one(*plugin)
        yield check_one.__name__


def parts_of(value: Any, path: str, seen: dict[int, str] | None = None) -> dict[str, str]:
    """Return the parts of an object, recursively, as text by path; ``seen`` has paths of visited objects by id."""
    seen = {} if seen is None else seen
    if value is None or isinstance(value, str | int | float | bool | bytes | type):
        return {path: repr(value)}
    if isinstance(value, set | frozenset):
        return {path: repr(sorted(map(repr, value)))}
    if isinstance(value, list | tuple):
        parts = {f"{path}[{n}]": part for n, part in enumerate(value)}
    elif not isinstance(value, Mapping) and (callable(value) or not hasattr(value, "__dict__")):
        return {path: type(value).__name__}
    elif id(value) in seen:  # references may be shared or cyclic
        return {path: seen[id(value)]}
    else:
        seen[id(value)] = path
        named = {repr(key): part for key, part in value.items()} if isinstance(value, Mapping) else vars(value)
        parts = {f"{path}.{name}": part for name, part in named.items()}
    return {inner: text for at, part in parts.items() for inner, text in parts_of(part, at, seen).items()}


def difference(before: Mapping[str, str], after: Mapping[str, str]) -> str:
    """Return the path of the first part that differs; empty if none."""
    return next((path for path in {**before, **after} if before.get(path) != after.get(path)), "")


N_MOMENTS = 150
FIELD_M = 400.0
"""Half-width of the square of sampled positions around the start of the vehicle."""
TICK_S = 2.0


@dataclass(frozen=True)
class DecisionInputs:
    """Inputs of a behaviour at one decision; ``kept`` is the pickled pair of motion and picture."""

    motion: Motion
    picture: Picture
    performed: bool
    kept: bytes


@lru_cache(maxsize=16)  # a run, asked by each check
def story(
    data: VehicleData, peers: tuple[str, ...], groups: tuple[str, ...], seed: int = 1, spell: int = 1
) -> list[DecisionInputs]:
    """Return sampled inputs of a vehicle, first without knowledge, later with peers and work.

    Sets performed, groups, reserve and area last for ``spell`` moments, in which a stated deadline is not cut short.
    """
    draw = random.Random(seed)
    picture, moments = Picture(frame_s=10.0), []
    sensors = "", *(sensor.name for sensor in data.sensors)
    for number in range(N_MOMENTS):
        if number % spell == 0:
            is_performed = (number // spell + seed) % 2 == 0
            reserve, outside_m = draw.uniform(0.0, 0.3), draw.choice([0.0, 0.0, 0.5, 40.0])
            if number > N_MOMENTS // 10:
                picture.groups = Groups(frozenset(name for name in groups if draw.random() < 0.5), draw.random() < 0.5)
        x_m, y_m = (start + draw.uniform(-FIELD_M, FIELD_M) for start in data.start_m)
        motion = Motion(
            x_m, y_m, draw.uniform(-math.pi, math.pi), draw.uniform(0.0, data.transit_speed_mps), 10.0 * number
        )
        picture.body = Body(
            now_s=TICK_S * number,
            battery=1.0 - number / N_MOMENTS,
            reserve=reserve,
            outside_m=outside_m,
            contacts_m=draw.choice([(), ((x_m + draw.uniform(-FIELD_M, FIELD_M), y_m),)]),
            yields_s=picture.body.yields_s,
        )
        if number > N_MOMENTS // 10:
            for name in peers:
                note_position(picture.peers, name, (draw.uniform(-FIELD_M, FIELD_M), draw.uniform(-FIELD_M, FIELD_M)))
                picture.peers.heard_s[name] = picture.body.now_s
            if draw.random() < 0.1:
                picture.peers.last_news_s = picture.body.now_s
                picture.body.yields_s = dict.fromkeys(sensors, picture.body.now_s)
            picture.groups.meets_unheard = draw.random() < 0.5
        # Copying by pickle takes an eighth of the time of a deep copy.
        kept = pickle.dumps((motion, picture))
        as_it_is: tuple[Motion, Picture] = pickle.loads(kept)
        moments.append(DecisionInputs(*as_it_is, is_performed, kept))
    return moments


def check(
    make_behaviour: Callable[[], Behaviour],
    data: VehicleData,
    peers: Sequence[str] = ("AUV01", "AUV02"),
    groups: Sequence[str] = ("Operational",),
) -> bool:
    """Check a behaviour against its protocol on sampled inputs; return whether it ever states a deadline.

    ``make_behaviour`` returns a new behaviour of the same vehicle at each call; ``peers`` and ``groups`` occur in the
    inputs. Raises AssertionError for a wrong type, stimulus outside 0..1, done state revoked, inputs modified, invalid
    reference or premature change of it, a change before the stated deadline or beyond ``per_m``, or nondeterminism.
    """
    for seed, spell in ((1, 1), (2, 10), (3, 10)):  # each moment with the activity performed and not
        moments = story(data, tuple(peers), tuple(groups), seed, spell)
        first, second = (_answers(make_behaviour(), moments) for _ in range(2))
        for number, (answer, other) in enumerate(zip(first, second, strict=True)):
            assert answer == other, f"moment {number}: two behaviours made alike answer {answer} and {other}"
        for number, (answer, other) in enumerate(zip(first, _answers(make_behaviour(), moments, True), strict=True)):
            states = "asked only when its until_s, peers and holds_m require it, its answer is"
            assert answer[0] == other[0], f"moment {number}: {states} {other[0]}; asked at every decision, {answer[0]}"
    perceive = make_behaviour().perceive
    return any(perceive(m.motion, m.picture, m.performed).until_s > m.picture.body.now_s for m in moments)


def _answers(
    behaviour: Behaviour, moments: Sequence[DecisionInputs], by_deadline: bool = False
) -> list[tuple[Perception, Reference | None]]:
    """Return the answers at all moments; ``by_deadline`` reuses perceptions while valid."""
    answers = []
    was_done = False
    perceived, reference, n_heard = IDLE, None, 0
    rests_on: tuple[object, ...] = ()
    motion, picture = pickle.loads(moments[0].kept)
    asked_at_m = motion.position_m
    for number, moment in enumerate(moments):
        where = f"moment {number}"
        _become(motion, picture, moment)
        rested_on, rests_on = rests_on, basis(picture, moment.performed)
        # The rule of ``FunctionalLayer.perceive``: with ``by_deadline`` the check asks as rarely as a run.
        is_on_leg = reference is not None and distance_m(motion, reference.target_m) > reference.holds_m
        is_valid = picture.body.now_s < perceived.until_s and rested_on == rests_on
        is_valid &= n_heard == sum(picture.peers.n_positions.get(peer, 0) for peer in perceived.peers)
        is_valid &= is_on_leg or reference is None or not moment.performed
        moved_m, before = distance_m(motion, asked_at_m), perceived
        is_valid &= moved_m == 0.0 or moved_m < perceived.until_m
        if not (by_deadline and is_valid and perceived.per_m * moved_m == 0.0):
            perceived, asked_at_m = behaviour.perceive(motion, picture, moment.performed), motion.position_m
            assert isinstance(perceived, Perception), f"{where}: perceive returned {perceived!r}, expected a Perception"
            change = abs(perceived.stimulus - before.stimulus)
            says = f"its stimulus has changed by {change} over {moved_m} m, but per_m is {before.per_m}"
            assert change <= before.per_m * moved_m + ROUNDING or not (is_valid and before.per_m), f"{where}: {says}"
            n_heard = sum(picture.peers.n_positions.get(peer, 0) for peer in perceived.peers)
        progress = perceived.progress(motion, picture)
        picture.body.decided_s = picture.body.now_s
        _check_perception(perceived, where, progress)
        assert perceived.done or not was_done, f"{where}: what was done comes back: {perceived}"
        was_done = perceived.done
        reference = behaviour.reference(motion, picture)
        _check_reference(reference, where)
        assert behaviour.reference(motion, picture) == reference, f"{where}: asked again, reference answers differently"
        if reference is not None:
            _check_holding(behaviour, reference, motion, picture, where)
        picture.body.decided_s = moment.picture.body.decided_s
        assert motion == moment.motion, f"{where}: the behaviour changed the motion, which only the control may"
        assert picture == moment.picture, f"{where}: the behaviour changed the picture, which only its owners may"
        answer = perceived._replace(
            answers=perceived.settled, ends=None, until_s=-math.inf, peers=(), until_m=math.inf, per_m=0.0
        )
        answers.append((answer._replace(advance=progress), reference))
    return answers


def _become(motion: Motion, picture: Picture, moment: DecisionInputs) -> None:
    # The same objects throughout, as in a run.
    motion_then, picture_then = pickle.loads(moment.kept)
    for name in Motion.__slots__:
        setattr(motion, name, getattr(motion_then, name))
    for part in fields(Picture):
        setattr(picture, part.name, getattr(picture_then, part.name))
    picture.facts = moment.picture.facts  # none, equal only to itself


def _check_perception(perceived: Perception, where: str, advance: float | None) -> None:
    stimulus, concludes, ends = perceived.stimulus, perceived.concludes, perceived.ends
    is_share = isinstance(stimulus, float | int) and 0.0 <= stimulus <= 1.0
    assert is_share, f"{where}: stimulus is {stimulus!r}, expected a number of 0..1"
    is_degree = advance is None or (isinstance(advance, float | int) and -1.0 <= advance <= 1.0)
    assert is_degree, f"{where}: advance is {advance!r}, expected a number of -1..1 or None"
    assert not math.isnan(perceived.until_s), f"{where}: until_s is {perceived.until_s!r}, expected a time (s)"
    assert perceived.until_m >= 0.0, f"{where}: until_m is {perceived.until_m!r}, expected a distance (m)"
    assert 0.0 <= perceived.per_m < math.inf, f"{where}: per_m is {perceived.per_m!r}, expected 0 or more"
    for name in ("done", "failed", "makes_no_way", "is_beyond_it"):
        value = getattr(perceived, name)
        assert isinstance(value, bool), f"{where}: {name} is {value!r}, expected a bool"
    answers = perceived.settled
    is_share = isinstance(answers, float | int) and 0.0 <= answers <= 1.0
    assert is_share, f"{where}: answers is {answers!r}, expected a number of 0..1"
    is_list = isinstance(concludes, tuple) and all(isinstance(item, Observation) for item in concludes)
    assert is_list, f"{where}: concludes is {concludes!r}, expected a tuple of Observation"
    assert ends is None or callable(ends), f"{where}: ends is {ends!r}, expected a function or None"
    assert not (perceived.done and stimulus > 0.0), f"{where}: all is done, and yet the stimulus is {stimulus}"


def _check_reference(reference: object, where: str) -> None:
    if reference is None:
        return
    assert isinstance(reference, Reference), f"{where}: reference returned {reference!r}, expected a Reference or None"
    is_place = all(math.isfinite(coordinate) for coordinate in reference.target_m) and len(reference.target_m) == 2
    assert is_place, f"{where}: target_m is {reference.target_m}, expected two finite numbers"
    is_speed = 0.0 <= reference.speed_mps < math.inf
    assert is_speed, f"{where}: speed_mps is {reference.speed_mps}, expected 0 or more"
    assert reference.holds_m >= 0.0, f"{where}: holds_m is {reference.holds_m}, expected 0 or more, or infinite"


def _check_holding(behaviour: Behaviour, reference: Reference, motion: Motion, picture: Picture, where: str) -> None:
    (x_m, y_m), to_go_m = reference.target_m, distance_m(motion, reference.target_m)
    if not 0.0 < reference.holds_m < to_go_m:
        return
    share = 0.5 * (1.0 - reference.holds_m / to_go_m)
    nearer = copy.copy(motion)
    nearer.x_m, nearer.y_m = motion.x_m + share * (x_m - motion.x_m), motion.y_m + share * (y_m - motion.y_m)
    again = behaviour.reference(nearer, picture)
    assert again == reference, f"{where}: said to hold to {reference.holds_m:g} m, reference answers {again} before"
