"""Conformance checks of channel models and drivers, raising ``AssertionError``."""

import math
import time
from collections.abc import Callable, Iterator
from functools import partial
from random import Random
from typing import NamedTuple

from exchange.channel import loss
from exchange.channel.link import LinkModel, Transmission
from exchange.channel.models import ChannelModel, Deployment
from exchange.channel.modems import modems
from exchange.drivers import Driver, Paced
from missions.scenarios.channel import model_named
from remoras.testing.behaviours import passed

Model = type[ChannelModel] | ChannelModel

NODES = {"A": 0, "B": 1, "C": 2, "D": 3}
PAIRS = [(sender, receiver) for sender in NODES.values() for receiver in NODES.values() if sender != receiver]
RANGE_M = 1000.0
"""Maximum of the uniformly sampled distances, over which ``mean_per`` is checked."""
SLOT_S = 2.5
N_FRAMES = 60
MODEM = modems()["whoi-psk-1"]
"""Modem with several frames; packets are full, as ``mean_per`` assumes."""
DEPLOYMENT = Deployment(NODES, (0.0, 20.0, 40.0, 60.0), MODEM, RANGE_M, N_FRAMES * len(NODES) * SLOT_S)
N_ASKED = 400
N_SEEDS = 2000
N_STANDARD_ERRORS = 4.0


class Question(NamedTuple):
    """Arguments of ``LinkModel.p_loss``: packet, receiver and their distance."""

    packet: Transmission
    receiver: int
    range_m: float


def question(slot: int, sender: int, receiver: int, range_m: float) -> Question:
    """Return the arguments for a full packet sent at the start of a slot."""
    return Question(Transmission(slot, sender, slot * SLOT_S, MODEM.payload_bits), receiver, range_m)


def questions(n: int, seed: int = 1) -> Iterator[Question]:
    """Yield arguments for packets in random slots, evenly over links, at uniform distances."""
    dice = Random(seed)
    for number in range(n):
        sender, receiver = PAIRS[number % len(PAIRS)]
        slot = dice.randrange(N_FRAMES) * len(NODES) + sender
        yield question(slot, sender, receiver, dice.uniform(0.0, RANGE_M))


def links(model: Model, seed: int) -> LinkModel:
    """Return the link model of one run."""
    return _settings(model).link_model(DEPLOYMENT, seed)


def _settings(model: Model) -> ChannelModel:
    return model() if isinstance(model, type) else model


def check_declaration(model: Model) -> None:
    """Check title, default and description of every setting, and the required methods."""
    kind = model if isinstance(model, type) else type(model)
    assert issubclass(kind, ChannelModel), f"a subclass of ChannelModel is needed, not {kind.__name__}"
    assert kind.title.strip(), "has no title"
    for key, info in kind.model_fields.items():
        assert not info.is_required(), f"setting {key} has no default"
        assert info.description or _is_list_of_tables(info.annotation), f"setting {key} is not described"
    for method in ("link_model", "mean_per"):
        assert getattr(kind, method) is not getattr(ChannelModel, method), f"does not define {method}"


def _is_list_of_tables(annotation: object) -> bool:
    # Tables describe their own keys.
    return any(hasattr(part, "model_fields") for part in getattr(annotation, "__args__", ()))


def check_probabilities(model: Model) -> None:
    """Check that all losses are in 0..1, also at zero and extreme range."""
    mean = _settings(model).mean_per(DEPLOYMENT)
    assert _is_probability(mean), f"mean_per is {mean!r}, no number from 0 to 1"
    link = links(model, 1)
    empty = Question(Transmission(1, 1, SLOT_S, 0), 0, 100.0)
    for asked in [*questions(N_ASKED), question(0, 0, 1, 0.0), question(10**6, 1, 0, 1e6), empty]:
        answer = link.p_loss(*asked)
        assert _is_probability(answer), f"{asked}: {answer!r} is no number from 0 to 1"


def _is_probability(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0.0 <= value <= 1.0


def check_pure(model: Model) -> None:
    """Check that losses depend on seed and question only, not on order or instance."""
    asked = list(questions(N_ASKED))
    for seed in (0, 1, 2**61):
        link = links(model, seed)
        expected = {each: link.p_loss(*each) for each in asked}
        for other, how in ((link, "asked again"), (links(model, seed), "made anew")):
            for each in Random(seed).sample(asked, len(asked)):
                answer = other.p_loss(*each)
                assert answer == expected[each], f"seed {seed}, {each}: {how}, {answer}; before it was {expected[each]}"


def check_mean_per(model: Model) -> None:
    """Check ``mean_per`` against sampled losses, within four standard errors over seeds."""
    mean = _settings(model).mean_per(DEPLOYMENT)
    shares = []
    for seed in range(N_SEEDS):
        link, asked = links(model, seed), questions(len(PAIRS), seed)
        lost = [loss.uniform(seed, 0, q.packet.slot, q.packet.sender, q.receiver) < link.p_loss(*q) for q in asked]
        # Losses of one seed may be dependent, so the error is that of the means of seeds.
        shares.append(sum(lost) / len(lost))
    rate = sum(shares) / len(shares)
    variance = sum((share - rate) ** 2 for share in shares) / (len(shares) - 1)
    # At least the error of independent packets: rare losses may occur in no seed.
    error = math.sqrt(max(variance, mean * (1.0 - mean) / len(PAIRS)) / len(shares))
    assert abs(rate - mean) <= N_STANDARD_ERRORS * error, (
        f"mean_per is {mean:g}, but {rate:.4f} of {len(shares) * len(PAIRS)} packets are lost "
        f"({abs(rate - mean) / error if error else math.inf:.1f} standard errors away)"
    )


CHECKS: tuple[Callable[[Model], None], ...] = (
    check_declaration,
    check_probabilities,
    check_pure,
    check_mean_per,
)


def conforms(name: str) -> Iterator[str]:
    """Run all checks of a named channel model and yield their names."""
    return passed(CHECKS, model_named(name))


Pair = tuple[Driver, Driver, Paced]
PACKETS = [b"\x00", b"\n\r\x00\xff", bytes(range(64)), b"RMR1"]
"""Bytes that serial lines, text protocols or headers may misread; 64 fill a modem packet."""
TRIES = 50
PATIENCE_S = 5.0


def check_driver(make: Callable[[], Pair], least_bytes: int = 1) -> None:
    """Check drivers in pairs; they may lose, repeat or reorder packets of ``least_bytes`` up."""
    # The program sends 3 bytes or more.
    for holds in (
        partial(carries_packets_whole, least_bytes=least_bytes),
        does_not_hear_itself,
        waits_no_longer_than_it_is_told,
        is_silent_once_it_is_closed,
    ):
        sender, receiver, pace = make()
        holds(sender, receiver, pace)
        sender.close()
        receiver.close()


def _soon_s(pace: Paced) -> float:
    return pace.now_s + 0.05


def carries_packets_whole(sender: Driver, receiver: Driver, pace: Paced, least_bytes: int = 1) -> None:
    """Check that received packets equal sent ones and arrive with a valid time."""
    for driver in (sender, receiver):
        assert isinstance(driver, Driver), f"{type(driver).__name__} lacks send, receive or close"
    for data in (packet for packet in PACKETS if len(packet) >= least_bytes):
        for _ in range(TRIES):
            given_back: object = sender.send(data, pace.now_s)  # type: ignore[func-returns-value]  # that is what is asked
            assert given_back is None, "send gives something back"
            received = list(receiver.receive(_soon_s(pace)))
            if any(packet.data == data for packet in received):
                break
        else:
            raise AssertionError(f"{data!r} was never received in {TRIES} tries")
        for packet in received:
            assert packet.data in PACKETS, f"{packet.data!r} was received, but not sent"
            assert 0.0 <= packet.time_s < math.inf, f"received at {packet.time_s} s"


def does_not_hear_itself(sender: Driver, receiver: Driver, pace: Paced) -> None:
    """Check that a driver does not receive own packets, which would look like a duplicate node."""
    sender.send(PACKETS[2], 0.0)
    receiver.receive(_soon_s(pace))
    assert list(sender.receive(_soon_s(pace))) == [], "it receives its own packet"


def waits_no_longer_than_it_is_told(sender: Driver, receiver: Driver, pace: Paced) -> None:
    """Check that without packets a driver returns nothing at the deadline, at once if past."""
    for until_s, what in ((-1.0, "although the time is past"), (_soon_s(pace), "longer than the given time")):
        began_s = time.monotonic()
        assert list(sender.receive(until_s)) == []
        assert time.monotonic() - began_s < PATIENCE_S, f"it waits {what}"


def is_silent_once_it_is_closed(sender: Driver, receiver: Driver, pace: Paced) -> None:
    """Check that closing is idempotent and that later calls have no effect."""
    sender.close()
    sender.close()
    sender.send(PACKETS[0], 0.0)
    assert list(sender.receive(_soon_s(pace))) == []
    assert list(receiver.receive(_soon_s(pace))) == [], "it sends although it is closed"
