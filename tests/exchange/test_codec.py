"""Packets as bits: encoding changes only what fields quantise, and no bits can do harm."""

import zlib
from functools import cache
from itertools import permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import DURATION_S, N_BLOCKS, TBOX, attribute, cells, codec_of, instances
from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.packets import Fragment, InfluenceSignal, Packet, Summary
from exchange.policy.acknowledgement import slots_ago
from exchange.policy.policies import ACK, POLICIES, AckPolicy
from exchange.wire.codec import GRAMMAR, Codec, Framing, Widths
from missions.runs.setup import resolved
from missions.scenarios.loading import load
from worldmodel import EPOCHS, STATUS, Attribute, Field, OntologyClass, PropertyValue, TBox, Value, ValueKind
from worldmodel.ontology.fields import Grid

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
        draw(st.integers(0, (1 << 2 * n_nodes * n_nodes) - 1)),
        tuple(draw(st.lists(fragments(n_nodes), max_size=4))),
        tuple(draw(st.lists(st.builds(InfluenceSignal, st.integers(0, n_nodes), st.integers(-128, 127)), max_size=15))),
        draw(st.integers(0, 3)),
        summary=tuple(draw(st.lists(summaries(n_nodes), max_size=3))),
    )
    return codec_of(n_nodes, policy.name), policy, n_nodes, packet


def summaries(n_nodes: int) -> st.SearchStrategy[Summary]:
    """Of any origin and epoch, with sequences that the field has room for, and beyond."""
    highest = st.one_of(st.integers(-1, N_BLOCKS), st.integers(N_BLOCKS, 1 << 20))
    return st.builds(Summary, st.integers(0, n_nodes - 1), st.integers(0, 3), highest, st.integers(0, 255))


def on_the_wire(packet: Packet) -> list[Fragment]:
    """The fragments of a packet in the order of the wire: own ones first, of each origin by sequence."""

    def place(one: Fragment) -> tuple[bool, int, int, int, int]:
        return is_relayed(one, packet), one.origin, one.epoch, one.sequence, one.index

    return sorted(packet.fragments, key=place)


def is_relayed(fragment: Fragment, packet: Packet) -> bool:
    """True for a fragment of another origin or epoch than the sender's."""
    return (fragment.origin, fragment.epoch) != (packet.sender, packet.epoch)


def quantised(fragment: Fragment) -> Fragment:
    """To the nearest tenth of a second, and every value to the nearest of its grid."""
    stored = tuple(
        PropertyValue(f.subject, f.attribute, TBOX.attributes[f.attribute].quantise(f.value)) for f in fragment.facts
    )
    tenths = Grid(0.0, 0.1)
    time_s = tenths.value_at(tenths.index_of(fragment.time_s))
    return fragment._replace(time_s=time_s, facts=stored)


def bits_sent(packet: Packet, policy: AckPolicy, n_nodes: int, frame: int) -> int:
    """The acknowledgement bits that travel: the sender's row under ACK, else all; nobody acknowledges itself."""
    own_only = policy.acknowledgement == ACK or policy.acknowledgement.states
    carried = 0
    for row, column in permutations(range(n_nodes), 2):
        if row == packet.sender or not own_only:
            slot = frame * n_nodes + packet.sender - slots_ago(n_nodes, packet.sender, row, column)
            carried |= 1 << slot % (2 * n_nodes) * n_nodes + row
    return packet.acks & carried


# There and back -----------------------------------------------------------------------------------


@settings(max_examples=100, deadline=None)
@given(packets(), st.randoms(use_true_random=False), st.integers(0, 1000))
def test_a_packet_arrives_as_it_was_sent_with_the_size_added_up_before(made, dice, frame):
    """In whatever order fragments are offered to the packing, at whatever ages; none takes more than its most."""
    codec, policy, n_nodes, packet = made
    start_s = 8.0 * frame
    size_bits = codec.overhead_bits - codec.spare_bits(packet.sender, frame)
    size_bits += len(packet.signals) * codec.signal_bits + sum(codec.encode_summary(one)[1] for one in packet.summary)
    packing = codec.packing(packet.sender, packet.epoch, start_s, 1 << 20)
    most_bits = 0
    offered = tuple(dice.sample(packet.fragments, len(packet.fragments)))
    for fragment in offered:
        assert packing.add(fragment)
        most_bits += codec.fragment_bits(fragment, is_relayed(fragment, packet))
    fragments_bits = (1 << 20) - packing.left_bits
    assert fragments_bits == sum(size for _, size in packing.wired()[1]) <= most_bits
    data = codec.encode(
        packet.sender, packet.acks, offered, packet.signals, frame, packet.epoch, start_s, packet.summary
    )
    assert len(data) == -(-(size_bits + fragments_bits) // 8)
    received = codec.decode(data, frame, start_s).packet
    arrived = tuple(quantised(fragment) for fragment in on_the_wire(packet._replace(fragments=offered)))
    assert received == packet._replace(acks=bits_sent(packet, policy, n_nodes, frame), fragments=arrived, frame=frame)


# What is refused ----------------------------------------------------------------------------------


def fact_of(name: str, value: Value, subject: int = 0, sequence: int | None = None) -> Fragment:
    """A fact of node 0 at the start of the mission: a status if its attribute says so, else an item."""
    told = (PropertyValue(subject, attribute(name), value),)
    kind = STATUS if is_latest_only(told) else 0
    return Fragment(0, kind if sequence is None else sequence, 0.0, told)


def code(codec: Codec, *fragments: Fragment) -> bytes:
    """Packet of node 0 with these facts, in slot 0."""
    return codec.encode(0, 0, fragments)


ODD: dict[str, tuple[Fragment, str]] = {
    "a symbol of none": (fact_of("classification", 4), "classification: .*outside"),
    "no number": (fact_of("mappedCell", float("nan")), "mappedCell: nan is outside"),
    "infinite": (fact_of("mappedCell", float("inf")), "mappedCell: inf is outside"),
    "too large": (fact_of("mappedCell", 4096.0), r"mappedCell: 4096\.0 is outside"),
    "too small": (fact_of("mappedCell", -1.0), r"mappedCell: -1\.0 is outside"),
    "of another kind": (fact_of("mappedCell", True), "mappedCell: True is not a number"),
    "too far": (fact_of("position", (0.0, 10_000.5)), r"position: 10000\.5 is outside"),
    "no instance": (fact_of("position", (0.0, 0.0), 8), "instance 8 cannot be sent; allowed: 0 to 7"),
    "before the mission": (Fragment(0, 0, -0.2, cells(4, 1)), r"-0\.2 s"),
    "kept to itself": (Fragment(0, STATUS - 1, 0.0, cells(4, 1)), "block -2 of vehicle 0 is private"),
    "a status as an item": (fact_of("position", (0.0, 0.0), sequence=7), "sequence 7: a whole block of latest-only"),
    "an item as a status": (Fragment(0, STATUS, 0.0, cells(4, 1)), f"sequence {STATUS}: a whole block of latest-only"),
    "an epoch too many": (Fragment(0, 0, 0.0, cells(4, 1), epoch=EPOCHS), f"epoch {EPOCHS} cannot be sent"),
}


@pytest.mark.parametrize("name", ODD)
def test_contents_that_cannot_be_encoded_are_refused(name: str):
    fragment, why = ODD[name]
    with pytest.raises(ConfigurationError, match=why):
        code(codec_of(4), fragment)


def test_a_header_or_signal_that_cannot_be_encoded_is_refused():
    with pytest.raises(ConfigurationError, match=f"allowed: 0 to {EPOCHS - 1}"):
        codec_of(4).encode(0, 0, [], epoch=EPOCHS)
    with pytest.raises((ValueError, ConfigurationError)):
        codec_of(4).encode(0, 0, [], [InfluenceSignal(0, 200)])


def test_every_epoch_can_be_encoded_in_headers_items_and_summaries():
    codec = codec_of(4)
    for epoch in range(EPOCHS):
        relayed, summary = Fragment(1, 3, 0.0, cells(4, 1), epoch=epoch), Summary(2, epoch, 4, 0b101)
        data = codec.encode(0, 0, [relayed], (), 9, epoch, summary=[summary])
        assert codec.era_of(data, 9) == epoch // 4
        received = codec.decode(data, 9, 0.0, epoch // 4).packet
        assert (received.epoch, received.fragments, received.summary) == (epoch, (relayed,), (summary,))
        with pytest.raises(PeerFault, match="definition hash differs"):
            codec.decode(data, 9, 0.0, epoch // 4 + 1)


def test_the_grammar_is_the_one_whose_version_the_hash_covers():
    """Packets of every kind of section, bit by bit: who changes the layout raises ``GRAMMAR`` and writes this anew."""
    codec, crc = codec_of(4), 0
    fragments = [
        Fragment(0, 3, 8.0, cells(4, 1)), Fragment(0, 4, 8.0, cells(4, 2)), Fragment(0, 9, 1.0, cells(4, 1), 1, 3),
        Fragment(2, 5, 0.5, cells(4, 2)), Fragment(1, 6, 0.5, cells(4, 1), epoch=1),
    ]  # fmt: skip
    for frame in range(4):
        summary, signals = [Summary(2, 1, 7, 0b1001)], [InfluenceSignal(1, -7)]
        acks = sum(1 << (4 * frame - ago) % 8 * 4 for ago in (1, 3))  # node 0 received nodes 3 and 1
        data = codec.encode(0, acks, fragments, signals, frame, 1, 10.0, summary)
        crc = zlib.crc32(data[1:], crc)
    assert (GRAMMAR, crc) == (2, 1112525204)


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
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S, Widths(1.0)),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS // 2, DURATION_S),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S, Widths(recent_s=60.0)),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S, Widths(exchanged=frozenset({1, 2}))),
        Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S, framing=Framing(8)),
    ],
    ids=[
        "TBox",
        "policy",
        "nodes",
        "instances",
        "duration",
        "time resolution",
        "blocks",
        "recent",
        "exchanged",
        "CRC",
    ],
)
def test_a_different_protocol_definition_is_detected_within_four_frames(stranger: Codec):
    """A packet has a byte of the hash, by its frame: of four frames at least one is not read, whatever it carries."""
    ours = Codec(TBOX, 8, 4, POLICIES["ack"], N_BLOCKS, DURATION_S)
    wire = [Fragment(0, 0, 0.0, cells(4, 1))]
    refused = []
    for frame in range(4):
        for data in (stranger.encode(0, 0, [], frame=frame), stranger.encode(1, 0, wire, frame=frame)):
            try:
                ours.decode(data, frame)
            except PeerFault as fault:
                refused.append(isinstance(fault, DefinitionFault))
    assert True in refused


def test_a_packet_is_valid_in_one_frame_of_1024():
    """It has the counter of every fourth, but another first byte; after 256 times four, its own again."""
    codec = codec_of(4)
    data = codec.encode(1, 0, [Fragment(1, 0, 0.0, cells(4, 1))], frame=6)
    for frame in (*range(6), *range(7, 1030)):
        with pytest.raises(PeerFault):
            codec.decode(data, frame)
    assert codec.decode(data, 1030).packet.sender == 1


# Sizes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n_nodes", [2, 5, 10, 20, 64])
def test_acknowledgement_headers_have_the_sizes_of_the_paper(n_nodes: int):
    """A vector of N - 1 bits, a matrix of N (N - 1); and the packet grows by as much."""
    vector, matrix = codec_of(n_nodes, "ack"), codec_of(n_nodes, "m-ack")
    assert vector.overhead_bits - vector.head_bits - 3 == n_nodes - 1
    assert matrix.overhead_bits == codec_of(n_nodes, "mps-ack-repeat").overhead_bits
    assert matrix.overhead_bits - vector.overhead_bits == (n_nodes - 1) ** 2


def size_of(codec: Codec, *fragments: Fragment, sender: int = 0, slot_start_s: float = 0.0) -> int:
    """Bits of these fragments in a packet, as its packing adds them up."""
    packing = codec.packing(sender, 0, slot_start_s, 1 << 20)
    for fragment in fragments:
        assert packing.add(fragment)
    return (1 << 20) - packing.left_bits


def reference_codec() -> Codec:
    """For the record by which codecs are compared, of a fleet of five: 64 classes of 256 instances are 14 bits of
    subject; 32 attributes, places of two coordinates to 0.1 m in a kilometre, times in seconds of a day; a vehicle may
    tell 4096 items. Slots of 3.2 s and a guard of 1 s make frames of 21 s."""
    along = Field(0.0, 1000.0, 0.1, "m")
    classes = tuple(OntologyClass(uid, f"c{uid}", f"urn:c{uid}", ()) for uid in range(64))
    attributes = tuple(
        Attribute(uid, f"a{uid}", f"urn:a{uid}", 0, ValueKind.POINT, (along, along), latest_only=uid == 1)
        for uid in range(32)
    )
    return Codec(TBox(classes, attributes), 64 * 256, 5, POLICIES["ack"], 4096, 86_399.0, Widths(1.0, recent_s=21.0))


def test_the_comparison_record_has_its_documented_size():
    """Kind 1, age 1 + 5, subject 14, attribute 5, place 28: 54 bits; sequence 12, or 1 for the next of a packet. The
    same as a DCCL message body takes 68 bits, of which 4 are of an origin."""
    codec = reference_codec()
    items = [Fragment(0, 7 + n, 60.0, (PropertyValue(900, 0, (12.3, 45.6)),)) for n in range(8)]
    status = Fragment(0, STATUS, 60.0, (PropertyValue(900, 1, (12.3, 45.6)),))
    assert size_of(codec, status, slot_start_s=70.0) == 54
    assert size_of(codec, items[0], slot_start_s=70.0) == 54 + 12
    assert size_of(codec, *items, slot_start_s=70.0) / 8 == 54 + (12 + 7) / 8 <= 60
    assert codec.head_bits + 3 == 8 + 3 + 2 + 2 + 3 == 18  # hash, sender, epoch, frame, end
    assert codec.overhead_bits == 18 + 4


def test_a_fragment_that_does_not_fit_leaves_the_packing_unchanged():
    codec = reference_codec()
    items = [Fragment(0, n, 60.0, (PropertyValue(900, 0, (12.3, 45.6)),)) for n in range(4)]
    packing = codec.packing(0, 0, 70.0, 54 + 12 + 54)
    assert packing.add(items[1])
    assert not packing.add(items[2])  # one bit too little
    assert (packing.left_bits, len(packing.wired()[1])) == (54, 1)
    assert packing.add(items[2]._replace(sequence=STATUS, facts=(PropertyValue(900, 1, (12.3, 45.6)),)))
    assert packing.left_bits == 0


# Values that carry an uncertainty -----------------------------------------------------------------


def test_an_uncertainty_survives_encoding_and_its_absence_costs_one_bit():
    """`location`: 6 bits for 64 steps of half a metre, and one that says so; `position` may carry none."""
    codec, location = mission_codec(), TBOX.attribute_named("location").uid
    sizes = []
    for uncertainty in (None, 0.5, 2.0, 32.0):
        fragment = Fragment(0, 0, 0.0, (PropertyValue(0, location, (1.0, 2.0), uncertainty),))
        assert codec.decode(code(codec, fragment), 0).packet.fragments == (fragment,)
        sizes.append(size_of(codec, fragment))
    assert [size - sizes[0] for size in sizes] == [0, 6, 6, 6]
