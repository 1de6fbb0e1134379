"""Packets as bits: nothing changes on the way but what the fields quantise, and no bits can do harm."""

import random
import time
import zlib
from dataclasses import replace
from functools import cache

import pytest
from fleet_radio import (
    BATTERY,
    DURATION_S,
    MAPPED_CELL,
    N_BLOCKS,
    POSITION,
    TBOX,
    attribute,
    cells,
    codec_of,
    instances,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from exchange.codec import Codec
from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.names import width
from exchange.packets import Fragment, InfluenceSignal, Packet
from exchange.policies import ACK, POLICIES, AckPolicy, header_bits
from missions.runs.setup import resolved
from missions.scenarios.loading import load
from worldmodel import STATUS, Attribute, Field, OntologyClass, PropertyValue, TBox, Value, ValueKind
from worldmodel.fields import Grid

ATTRIBUTE_BITS = width(len(TBOX.attributes))
NODES = st.integers(2, 64)
POLICY_NAMES = st.sampled_from(sorted(POLICIES))


@cache
def mission_codec() -> Codec:
    """The codec of the mapping and rendezvous mission: 4 vehicles, 2 groups, 8 roles, 3 areas, 2 rally points and
    2 missions are 21 instances."""
    setup = resolved(load("mapping-rendezvous"))
    assert len(setup.instances) == 21
    return setup.codec


def values_of(kind: Attribute, n_instances: int) -> st.SearchStrategy[Value]:
    """Values in range, on their grid or not."""
    match kind.kind:
        case ValueKind.TYPE:
            return st.integers(0, len(TBOX.classes) - 1)
        case ValueKind.LINK:
            return st.integers(0, n_instances - 1)
        case ValueKind.SYMBOL:
            return st.integers(0, len(kind.symbols) - 1)
        case ValueKind.BOOLEAN:
            return st.booleans()
        case ValueKind.NUMBER:
            return st.floats(kind.fields[0].minimum, kind.fields[0].maximum)
        case ValueKind.POINT:
            return st.tuples(*(st.floats(field.minimum, field.maximum) for field in kind.fields))


@st.composite
def facts(draw: st.DrawFn, n_instances: int) -> PropertyValue:
    kind = draw(st.sampled_from(TBOX.attributes))
    return PropertyValue(draw(st.integers(0, n_instances - 1)), kind.uid, draw(values_of(kind, n_instances)))


@st.composite
def fragments(draw: st.DrawFn, n_nodes: int) -> Fragment:
    """Own or relayed, whole blocks or parts of larger ones."""
    count = draw(st.one_of(st.just(1), st.integers(2, 16)))
    told = tuple(draw(st.lists(facts(len(instances(n_nodes))), min_size=1, max_size=4)))
    return Fragment(
        draw(st.integers(0, n_nodes - 1)),
        STATUS if count == 1 and is_latest_only(told) else draw(st.integers(0, (1 << 14) - 1)),
        draw(st.floats(0.0, DURATION_S)),
        told,
        draw(st.integers(0, count - 1)),
        count,
        draw(st.integers(0, 3)),
    )


def is_latest_only(told: tuple[PropertyValue, ...]) -> bool:
    """True if a whole block of these facts is a status."""
    return all(TBOX.attributes[fact.attribute].latest_only for fact in told)


@st.composite
def packets(draw: st.DrawFn) -> tuple[Codec, AckPolicy, int, Packet]:
    n_nodes, policy = draw(NODES), POLICIES[draw(POLICY_NAMES)]
    packet = Packet(
        draw(st.integers(0, n_nodes - 1)),
        tuple(draw(st.integers(0, (1 << n_nodes) - 1)) for _ in range(n_nodes)),
        tuple(draw(st.lists(fragments(n_nodes), max_size=4))),
        tuple(draw(st.lists(st.builds(InfluenceSignal, st.integers(0, n_nodes), st.integers(-128, 127)), max_size=15))),
        draw(st.integers(0, 3)),
    )
    return codec_of(n_nodes, policy.name), policy, n_nodes, packet


def encoded(codec: Codec, packet: Packet) -> bytes:
    wire = [codec.encode_fragment(fragment, packet.sender, packet.epoch) for fragment in packet.fragments]
    return codec.encode(packet.sender, packet.rows, wire, packet.signals, epoch=packet.epoch)


def is_relayed(fragment: Fragment, packet: Packet) -> bool:
    """True for what is not of the sender in its present epoch."""
    return (fragment.origin, fragment.epoch) != (packet.sender, packet.epoch)


def quantised(fragment: Fragment) -> Fragment:
    """To the nearest tenth of a second, and every value to the nearest of its grid."""
    stored = tuple(
        PropertyValue(f.subject, f.attribute, TBOX.attributes[f.attribute].quantise(f.value)) for f in fragment.facts
    )
    tenths = Grid(0.0, 0.1)
    time_s = tenths.value_at(tenths.index_of(fragment.time_s))
    return replace(fragment, time_s=time_s, facts=stored)


def bits_sent(packet: Packet, policy: AckPolicy, n_nodes: int) -> tuple[int, ...]:
    """The acknowledgement bits that travel: the sender's row under ACK, else all; nobody acknowledges itself."""
    own_only = policy.acknowledgement == ACK
    return tuple(0 if own_only and i != packet.sender else row & ~(1 << i) for i, row in enumerate(packet.rows))


# There and back -----------------------------------------------------------------------------------


@settings(max_examples=200, deadline=None)
@given(packets())
def test_a_packet_arrives_as_it_was_sent(made: tuple[Codec, AckPolicy, int, Packet]):
    codec, policy, n_nodes, packet = made
    received = codec.decode(encoded(codec, packet))
    assert (received.sender, received.epoch) == (packet.sender, packet.epoch)
    assert received.rows == bits_sent(packet, policy, n_nodes)
    assert received.signals == packet.signals
    assert received.fragments == tuple(quantised(fragment) for fragment in packet.fragments)


@settings(max_examples=100, deadline=None)
@given(packets())
def test_what_is_received_can_be_relayed_without_changing_again(made: tuple[Codec, AckPolicy, int, Packet]):
    codec, _, n_nodes, packet = made
    received = codec.decode(encoded(codec, packet))
    relay = (packet.sender + 1) % n_nodes
    again = codec.decode(encoded(codec, Packet(relay, received.rows, received.fragments, received.signals)))
    assert again.fragments == received.fragments


@pytest.mark.parametrize("kind", list(ValueKind))
def test_the_ontology_has_every_kind_of_value(kind: ValueKind):
    """So the round trip above has met them all."""
    assert any(a.kind is kind for a in TBOX.attributes)


@pytest.mark.parametrize("n_nodes", [2, 3, 32, 33, 64])
def test_extremes_of_every_field(n_nodes: int):
    codec, last = codec_of(n_nodes), len(instances(n_nodes)) - 1
    corners = [
        Fragment(0, STATUS, 0.0, (PropertyValue(0, POSITION, (-10_000.0, -10_000.0)),)),
        Fragment(0, 0, 0.0, cells(n_nodes, 1), epoch=3),
        Fragment(
            n_nodes - 1, (1 << 14) - 1, DURATION_S, (PropertyValue(last, POSITION, (10_000.0, 10_000.0)),), 15, 16
        ),
        Fragment(0, 1, 0.1, (PropertyValue(last, MAPPED_CELL, 4095.0), PropertyValue(0, BATTERY, 1.0)), 0, 2),
    ]
    packet = Packet(0, (0,) * n_nodes, tuple(corners), (InfluenceSignal(last, -128), InfluenceSignal(0, 127)), 2)
    received = codec.decode(encoded(codec, packet))
    assert (received.fragments, received.signals, received.epoch) == (packet.fragments, packet.signals, 2)


def whole_block(told: tuple[PropertyValue, ...]) -> Fragment:
    """A block of node 0 at the start of the mission: a status if its attributes say so, else an item."""
    return Fragment(0, STATUS if is_latest_only(told) else 0, 0.0, told)


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value"),
    [("mappedCell", 4096.0), ("batteryFraction", -0.2), ("position", (0.0, 10_000.5)), ("classification", 4)],
)
def test_a_value_out_of_range_is_never_sent_as_something_else(name: str, value: Value):
    """DCCL by default sends 1200 in 0..1000 as 0 without a word."""
    fragment = whole_block((PropertyValue(0, attribute(name), value),))
    with pytest.raises((ValueError, ConfigurationError), match=r"outside"):
        codec_of(4).encode_fragment(fragment, 0)


@pytest.mark.parametrize(("name", "value"), [("mappedCell", 4096.0), ("batteryFraction", -0.2)])
def test_a_value_out_of_range_is_refused_by_the_name_of_its_attribute(name: str, value: float):
    fragment = whole_block((PropertyValue(0, attribute(name), value),))
    with pytest.raises((ValueError, ConfigurationError), match=name):
        codec_of(4).encode_fragment(fragment, 0)


def test_an_instance_without_a_wire_name_is_refused():
    with pytest.raises(ConfigurationError, match="instance 8 has no wire name, 0 to 7 have"):
        codec_of(4).encode_fragment(whole_block((PropertyValue(8, POSITION, (0.0, 0.0)),)), 0)


def test_a_time_behind_the_end_of_the_mission_is_refused():
    with pytest.raises((ValueError, ConfigurationError), match="14401"):
        codec_of(4).encode_fragment(Fragment(0, 0, 14_401.0, cells(4, 1)), 0)


def test_a_vehicle_that_has_used_up_its_sequence_numbers_is_told_so():
    with pytest.raises(ConfigurationError, match="vehicle 2 has told more than 16384 items"):
        codec_of(4).encode_fragment(Fragment(2, 1 << 14, 0.0, cells(4, 1)), 0)


def test_what_a_vehicle_keeps_to_itself_has_no_form_on_the_wire():
    with pytest.raises(ConfigurationError, match="block -2 of vehicle 0 is private"):
        codec_of(4).encode_fragment(Fragment(0, STATUS - 1, 0.0, cells(4, 1)), 0)


def test_an_item_of_latest_only_attributes_would_be_read_as_a_status():
    position = (PropertyValue(0, POSITION, (0.0, 0.0)),)
    for told, sequence in ((position, 7), (cells(4, 1), STATUS)):
        with pytest.raises(ConfigurationError, match=f"sequence {sequence}: a whole block of latest-only attributes"):
            codec_of(4).encode_fragment(Fragment(0, sequence, 0.0, told), 0)


def test_a_fifth_epoch_has_no_name():
    codec, wanted = codec_of(4), "epoch 4 has no name on the wire; allowed: 0 to 3"
    with pytest.raises(ConfigurationError, match=wanted):
        codec.encode_fragment(Fragment(0, 0, 0.0, cells(4, 1), epoch=4), 0)
    with pytest.raises(ConfigurationError, match=wanted):
        codec.encode(0, [0] * 4, [], epoch=4)


def test_a_signal_that_is_no_signed_byte_is_never_sent_as_another():
    with pytest.raises((ValueError, ConfigurationError)):
        codec_of(4).encode(0, [0] * 4, [], [InfluenceSignal(0, 200)])


def test_more_fragments_than_can_be_counted_are_refused():
    codec = codec_of(4)
    wire = [codec.encode_fragment(Fragment(0, sequence, 0.0, cells(4, 1)), 0) for sequence in range(32)]
    with pytest.raises((ValueError, ConfigurationError)):
        codec.encode(0, [0] * 4, wire)


# Strangers ----------------------------------------------------------------------------------------


def with_another_attribute() -> TBox:
    extra = Attribute(len(TBOX.attributes), "depth", "urn:depth", 0, ValueKind.BOOLEAN)
    return TBox(TBOX.classes, (*TBOX.attributes, extra))


@pytest.mark.parametrize(
    "stranger",
    [
        Codec(with_another_attribute(), 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S),
        Codec(TBOX, 8, 4, POLICIES["m-ack"], N_BLOCKS, DURATION_S),
        Codec(TBOX, 8, 5, POLICIES["ack"], N_BLOCKS, DURATION_S),
        Codec(TBOX, 9, 4, POLICIES["ack"], N_BLOCKS, DURATION_S),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S / 2),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S, 1.0),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS // 2, DURATION_S),
    ],
    ids=["TBox", "policy", "nodes", "instances", "duration", "time resolution", "blocks"],
)
def test_another_definition_is_noticed_within_four_frames(stranger: Codec):
    """A packet has a byte of the hash, by its frame: of four frames at least one is not read, whatever it carries."""
    ours = Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S)
    wire = [stranger.encode_fragment(Fragment(0, 0, 0.0, cells(4, 1)), 0)]
    refused = []
    for frame in range(4):
        for data in (stranger.encode(0, [0] * 5, [], frame=frame), stranger.encode(1, [0] * 5, wire, frame=frame)):
            try:
                ours.decode(data, frame)
            except PeerFault as fault:
                refused.append(isinstance(fault, DefinitionFault))
    assert True in refused


def test_four_frames_carry_the_whole_hash():
    """The first bytes of the packets of four frames are a CRC-32, and those of the next four the same."""
    codec = Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S)
    firsts = [codec.encode(0, [0] * 4, [], frame=frame)[0] for frame in range(8)]
    every = tuple(range(len(TBOX.attributes)))  # all are exchanged where none are named
    shape = TBOX.hash, 8, 4, N_BLOCKS, 3, DURATION_S, 0.1, every  # a vector of acknowledgements has 3 bits
    assert bytes(firsts) == 2 * zlib.crc32(repr(shape).encode()).to_bytes(4, "big")


def test_two_vehicles_that_were_built_alike_understand_each_other():
    one, other = (Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S) for _ in range(2))
    data = one.encode(3, [0, 0, 0, 0b0101], [one.encode_fragment(Fragment(3, 9, 4.2, cells(4, 2)), 3)])
    assert other.decode(data) == Packet(3, (0, 0, 0, 0b0101), (Fragment(3, 9, 4.2, cells(4, 2)),))


# Damage -------------------------------------------------------------------------------------------


def busy_packet(codec: Codec, n_nodes: int) -> bytes:
    """Own, relayed and partial blocks of every kind of value, and signals."""
    every_kind = tuple(
        PropertyValue(0, kind.uid, kind.decode([0] * max(1, len(kind.fields)))) for kind in TBOX.attributes
    )
    content = (
        Fragment(1, 3, 12.3, cells(n_nodes, 2)),
        Fragment(0, 700, 14_399.9, every_kind),
        Fragment(1, 4, 99.0, cells(n_nodes, 3), 2, 5),
    )
    return encoded(codec, Packet(1, (3,) * n_nodes, content, (InfluenceSignal(2, -100), InfluenceSignal(3, 5))))


def survives(codec: Codec, data: bytes) -> bool:
    """Is it a packet? Anything but a packet or a PeerFault leaves this function as an error."""
    try:
        return isinstance(codec.decode(data), Packet)
    except PeerFault:
        return False


@pytest.mark.parametrize("policy", sorted(POLICIES))
@pytest.mark.parametrize("n_nodes", [2, 4, 7])
def test_a_packet_cut_short_anywhere_is_a_peers_fault_at_most(policy: str, n_nodes: int):
    codec = codec_of(n_nodes, policy)
    data = busy_packet(codec, n_nodes)
    assert survives(codec, data)
    assert not any(survives(codec, data[:length]) for length in range(len(data)))
    assert not survives(codec, data + b"\0")


@pytest.mark.parametrize("policy", sorted(POLICIES))
@pytest.mark.parametrize("n_nodes", [2, 4, 7])
def test_a_packet_with_one_bit_flipped_is_another_packet_or_a_peers_fault(policy: str, n_nodes: int):
    codec = codec_of(n_nodes, policy)
    data = busy_packet(codec, n_nodes)
    original = codec.decode(data)
    word = int.from_bytes(data, "big")
    for bit in range(8 * len(data)):
        flipped = (word ^ 1 << bit).to_bytes(len(data), "big")
        if survives(codec, flipped):
            assert codec.decode(flipped) != original  # no bit is without a meaning


def throw_noise_at(codec: Codec, n: int) -> list[bytes]:
    """n random byte strings; every second one with the hash of this fleet, to get past the door."""
    generator = random.Random(20_260_725)
    head = codec.encode(0, [0] * 64, [])[:1]
    slow = []
    for number in range(n):
        data = generator.randbytes(generator.randrange(65))
        if number % 2:
            data = head + data[1:]
        began_s = time.process_time()
        survives(codec, data)
        if time.process_time() - began_s > 0.010:
            slow.append(data)
    return slow


def decoding_s(codec: Codec, data: bytes) -> float:
    """CPU time of one decode, the best of five: what else the machine does is not the packet's fault."""
    best_s = float("inf")
    for _ in range(5):
        codec.decode.cache_clear()
        began_s = time.process_time()
        survives(codec, data)
        best_s = min(best_s, time.process_time() - began_s)
    return best_s


@pytest.mark.parametrize(("policy", "n_nodes"), [("ack", 4), ("mps-ack-repeat", 13)])
def test_noise_is_a_peers_fault_at_most_and_takes_no_time(policy: str, n_nodes: int):
    codec = codec_of(n_nodes, policy)
    assert all(decoding_s(codec, data) <= 0.010 for data in throw_noise_at(codec, 10_000))


@pytest.mark.slow
def test_much_noise_is_a_peers_fault_at_most():
    codec = codec_of(5, "m-ack")
    assert all(decoding_s(codec, data) <= 0.010 for data in throw_noise_at(codec, 200_000))


# Sizes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("n_values", "size_bits"), [(1, 0), (2, 1), (3, 2), (4, 2), (5, 3), (64, 6), (65, 7)])
def test_width_tells_so_many_values_apart(n_values: int, size_bits: int):
    assert width(n_values) == size_bits


@pytest.mark.parametrize("n_nodes", [2, 5, 10, 20, 64])
def test_acknowledgement_headers_have_the_sizes_of_the_paper(n_nodes: int):
    """A vector of N - 1 bits, a matrix of N (N - 1); and the packet grows by as much."""
    vector, matrix = codec_of(n_nodes, "ack"), codec_of(n_nodes, "m-ack")
    assert vector.header.largest_bits == n_nodes - 1
    assert (
        matrix.header.largest_bits == codec_of(n_nodes, "mps-ack-repeat").header.largest_bits == n_nodes * (n_nodes - 1)
    )
    assert matrix.overhead_bits - vector.overhead_bits == (n_nodes - 1) ** 2


def test_a_matrix_of_twenty_nodes_does_not_fit_the_smallest_frame():
    """380 bits are 47.5 B, and the frame has 32 B."""
    assert header_bits(POLICIES["m-ack"], 20) == 380
    assert codec_of(20, "m-ack").overhead_bits > 256


def test_the_size_of_an_own_observation_of_the_mission():
    """Head: relayed 1, time ceil(log2 144001) = 18, larger block 1; fact: instance 5, attribute, cell 12, follows 1;
    sequence 11, for at most 300 cells and 1024 items to spare. With 32 attributes 54 bits; the same record as a DCCL
    message body takes 68."""
    codec = mission_codec()
    size_bits = (1 + 18 + 1) + (5 + ATTRIBUTE_BITS + 12 + 1) + 11
    assert codec.fragment_bits(Fragment(0, 0, 0.0, cells(4, 1)), relayed=False) == size_bits
    assert codec.fragment_bits(Fragment(0, 0, 0.0, cells(4, 1))) == size_bits + 2 + 2  # whose it is, of which epoch


def test_a_status_has_no_sequence():
    """A position: head 20, instance 5, attribute, 2 * 16, follows 1."""
    status = Fragment(0, STATUS, 0.0, (PropertyValue(0, POSITION, (0.0, 0.0)),))
    assert mission_codec().fragment_bits(status, relayed=False) == (1 + 18 + 1) + (5 + ATTRIBUTE_BITS + 32 + 1)


def reference_codec() -> Codec:
    """For the record by which codecs are compared: 64 classes, 256 instances, 32 attributes, 16 origins, one hour in
    seconds, places of two coordinates to 0.1 m in a kilometre; a vehicle may tell 4096 items."""
    along = Field(0.0, 1000.0, 0.1, "m")
    classes = tuple(OntologyClass(uid, f"c{uid}", f"urn:c{uid}", ()) for uid in range(64))
    attributes = tuple(
        Attribute(uid, f"a{uid}", f"urn:a{uid}", 0, ValueKind.POINT, (along, along), latest_only=uid == 1)
        for uid in range(32)
    )
    return Codec(TBox(classes, attributes), 256, 16, POLICIES["ack"], 4096, 3600.0, 1.0)


def test_the_record_by_which_codecs_are_compared():
    """As an item 1 + 12 + 1, 8 + 5 + 28 + 1 and 12 of sequence, DCCL's 68 bits; as a status 56; relayed 4 + 2 more."""
    codec, place = reference_codec(), (12.3, 45.6)
    item = Fragment(0, 7, 60.0, (PropertyValue(9, 0, place),))
    status = Fragment(0, STATUS, 60.0, (PropertyValue(9, 1, place),))
    for told, size_bits in ((item, 68), (status, 56)):
        assert codec.encode_fragment(told, 0)[1] == size_bits
        assert codec.encode_fragment(told, 1)[1] == size_bits + 6


@pytest.mark.parametrize(("payload_bytes", "at_least"), [(32, 4), (64, 8)])
def test_observations_per_packet(payload_bytes: int, at_least: int):
    """A DCCL container of 25 bits and 68 per observation holds 3 in 32 B and 7 in 64 B; the head is no larger here."""
    codec = mission_codec()
    assert codec.overhead_bits == 8 + 2 + 2 + 3 + 5 + 4 <= 25
    size_bits = codec.fragment_bits(Fragment(0, 0, 5.0, cells(4, 1)), relayed=False)
    n_fit = (8 * payload_bytes - codec.overhead_bits) // size_bits
    assert n_fit >= at_least
    own = [codec.encode_fragment(Fragment(0, sequence, 5.0, cells(4, 1)), 0) for sequence in range(n_fit + 1)]
    assert len(codec.encode(0, [0] * 4, own[:n_fit])) <= payload_bytes < len(codec.encode(0, [0] * 4, own))


@settings(max_examples=100, deadline=None)
@given(packets())
def test_sizes_asked_for_beforehand_are_those_sent(made: tuple[Codec, AckPolicy, int, Packet]):
    codec, _, _, packet = made
    size_bits = codec.overhead_bits + len(packet.signals) * codec.signal_bits
    for fragment in packet.fragments:
        size_bits += codec.fragment_bits(fragment, is_relayed(fragment, packet))
    assert len(encoded(codec, packet)) == -(-size_bits // 8)


@settings(max_examples=100, deadline=None)
@given(packets())
def test_the_size_listing_adds_up_to_what_is_sent(made: tuple[Codec, AckPolicy, int, Packet]):
    """Every field that a packet has is in the listing, in as many bits."""
    codec, _, _, packet = made
    size = {(line.group, line.field): line.size_bits for line in codec.listing()}
    size_bits = sum(bits for (group, _), bits in size.items() if group == "packet")
    size_bits += len(packet.signals) * (size["signal", "role"] + size["signal", "value"])
    for fragment in packet.fragments:
        size_bits += sum(size["fragment", field] for field in ("relayed", "time", "part of a larger block"))
        size_bits += 0 if fragment.is_status else size["fragment", "sequence"]
        if is_relayed(fragment, packet):
            size_bits += size["fragment", "origin"] + size["fragment", "origin's epoch"]
        size_bits += size["fragment", "index"] + size["fragment", "count"] if fragment.count > 1 else 0
        for fact in fragment.facts:
            size_bits += size["fact", "subject"] + size["fact", "attribute"] + size["fact", "another follows"]
            size_bits += size["fact", TBOX.attributes[fact.attribute].name]
            uncertain = size.get(("fact", f"uncertainty of {TBOX.attributes[fact.attribute].name}"), 0)
            size_bits += uncertain if fact.uncertainty is not None else min(1, uncertain)
    assert len(encoded(codec, packet)) == -(-size_bits // 8)


def test_the_listing_says_what_each_field_is_for():
    """The mission of four vehicles: times to 14 400 s in tenths, 21 instances, cells 0 to 4095."""
    lines = {(line.group, line.field): line for line in mission_codec().listing()}
    assert [group for group, _ in lines] == sorted(
        (g for g, _ in lines), key=["packet", "fragment", "fact", "signal"].index
    )
    assert {name for group, name in lines if group == "fact"} >= {a.name for a in TBOX.attributes}
    assert lines["packet", "acknowledgements"].size_bits == 3
    assert lines["packet", "acknowledgements"].note == "policy ack"
    assert lines["fragment", "time"].note == "0 to 14400.1 s, steps of 0.1 s"
    assert lines["fact", "subject"].note == "one of 21 instances"
    assert lines["fact", "mappedCell"].size_bits == 12
    assert lines["fact", "mappedCell"].note.startswith("0 to 4095")


# A header that changes from frame to frame --------------------------------------------------------


def only_in_even_frames(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    return frame == 0 and row == sender


def test_a_header_may_differ_from_frame_to_frame():
    """Four nodes: a vector of 3 bits in even frames, none in odd ones; both sides ask the same function."""
    kind = ACK._replace(name="sparse", carries=only_in_even_frames, period_frames=2)
    codec = Codec(TBOX, 8, 4, AckPolicy(kind, False), N_BLOCKS, DURATION_S)
    assert [codec.header.size_bits(1, frame) for frame in range(4)] == [3, 0, 3, 0]
    assert codec.header.largest_bits == 3
    rows = [0, 0b1101, 0, 0]
    for frame, heard in ((0, 0b1101), (1, 0), (6, 0b1101)):
        received = codec.decode(codec.encode(1, rows, [], [InfluenceSignal(0, 5)], frame), frame)
        assert received == Packet(1, (0, heard, 0, 0), (), (InfluenceSignal(0, 5),))
