"""Level of detail by bandwidth: where the queue is long, values are recorded, and told, on a coarser grid."""

import math
from pathlib import Path
from statistics import fmean

import pytest

from exchange.manager import ExchangeManager
from exchange.policies import POLICIES
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec
from exchange.wire.codes import Reader
from exchange.wire.factcodec import FactCodec
from missions.features.coarse_above import Detail
from remoras.beliefs import Beliefs
from worldmodel import (
    InformationNeed,
    Instance,
    NeedsIndex,
    PropertyValue,
    TBox,
    WorldModel,
    core_ontology_paths,
    merge,
    read_tbox,
)

WORDS = """
@prefix ex: <https://w3id.org/x/detail#> .
@prefix rm: <https://w3id.org/remoras/marine#> .
@prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
<https://w3id.org/x/detail> a owl:Ontology .
ex:turbidity a owl:DatatypeProperty ; rdfs:domain rm:Vehicle ; rdfs:range xsd:double ;
    rm:minimum 0 ; rm:maximum 1000 ; rm:resolution 0.01 ; rm:sigma 1 .
"""
COARSE = "ex:turbidity rm:coarseResolution 10 . rm:position rm:coarseResolution 8 .\n"
AUV, BUOY = 0, 1
SLOT_S, N_SLOTS = 2.0, 200


def tbox_of(folder: Path, more: str = COARSE) -> TBox:
    path = folder / "words.ttl"
    path.write_text(WORDS + more)
    return read_tbox(*core_ontology_paths(), path)


def instances(tbox: TBox) -> list[Instance]:
    auv = tbox.class_named("AUV").uid
    return [Instance(AUV, auv, "AUV"), Instance(BUOY, auv, "buoy")]


def mean_latency_s(tbox: TBox, n_per_frame: int, above: int) -> tuple[float, set[float], bool]:
    """AUV measures so often per frame, in packets of 32 bytes, without loss.

    Returns:
        Mean time from observation to reception; what is received; whether all that is known was told so.
    """
    turbidity = tbox.attribute_named("turbidity")
    codec = Codec(tbox, 2, 2, POLICIES["ack"], 1 << 14, 14_400.0)
    needs = NeedsIndex(tbox, {BUOY: [InformationNeed(turbidity.uid, 1, class_uid=turbidity.domain)], AUV: []})
    schedule = TdmaSchedule(2, SLOT_S - 0.5, 0.5)
    models = [WorldModel(tbox, n, instances(tbox), n_origins=2, run_time_instances_per_origin=0) for n in range(2)]
    managers = [
        ExchangeManager(n, model, codec, schedule, POLICIES["ack"], 8 * 32, needs) for n, model in enumerate(models)
    ]
    beliefs = Beliefs(models[AUV])
    beliefs.rounded = Detail(tbox, lambda: len(managers[AUV].queue), above).of
    latencies_s, received = [], set()
    for slot in range(N_SLOTS):
        now_s, sender = schedule.start_s(slot), schedule.owner(slot)
        for number in range(n_per_frame if sender == AUV else 0):
            fact = AUV, turbidity.uid, (slot * 37.77 + number * 91.13) % 1000.0
            managers[AUV].offer([beliefs.record([fact], now_s, private=False)])
        reception = managers[1 - sender].receive(managers[sender].packet_to_send(now_s).data, now_s + 1.0)
        merge(models[1 - sender], reception.blocks)
        latencies_s += [now_s + 1.0 - block.time_s for block in reception.blocks]
        received |= {fact.value for block in reception.blocks for fact in block.facts}
    told, known = ({(one.time_s, one.value) for one in model.history(AUV, turbidity.uid)} for model in models)
    return fmean(latencies_s), received, known <= told


def is_on_grid(value: float) -> bool:
    return value % 10.0 == 0.0


@pytest.mark.slow
def test_coarse_values_bring_latency_down_where_the_queue_is_too_long_and_only_there(tmp_path: Path) -> None:
    tbox = tbox_of(tmp_path)
    fine_s, fine, _ = mean_latency_s(tbox, 12, above=10_000)
    coarse_s, coarse, same = mean_latency_s(tbox, 12, above=10)
    assert coarse_s < 0.8 * fine_s  # 75 s for 117 s
    assert same
    assert any(map(is_on_grid, coarse))
    assert not all(map(is_on_grid, fine))
    # The cause taken out: a queue that never gets long, and an attribute that declares nothing.
    assert mean_latency_s(tbox, 2, above=10) == mean_latency_s(tbox, 2, above=10_000)
    plain = tbox_of(tmp_path, "")
    assert mean_latency_s(plain, 12, above=10) == mean_latency_s(plain, 12, above=10_000)


def test_a_coarse_value_takes_fewer_bits_and_comes_back_as_the_same_double(tmp_path: Path) -> None:
    """1000 / 0.01 + 1 values take 17 bits, 1000 / 10 + 1 take 7; a place 16 each or, by 8 m, 12 each."""
    tbox, plain = tbox_of(tmp_path), tbox_of(tmp_path, "")
    codec, without = FactCodec(tbox, 4, None), FactCodec(plain, 4, None)
    turbidity, position = tbox.attribute_named("turbidity").uid, tbox.attribute_named("position").uid
    for attribute, value, saved_bits in [
        (turbidity, 340.0, 17 - 7 - 1),
        (turbidity, 340.01, -1),
        (turbidity, 1000.0, None),
        (position, (-10_000.0, 800.0), 32 - 24 - 1),
        (position, (-10_000.0, 800.5), -1),
        (position, (40_000.0, 800.0), None),
    ]:
        fact = PropertyValue(1, attribute, value)
        bits, size_bits = codec.of_one(fact)
        pad_bits = -size_bits % 8
        reader = Reader((bits << pad_bits).to_bytes((size_bits + pad_bits) // 8, "big"))
        assert codec.read_one(reader) == fact
        assert reader.left == pad_bits
        if saved_bits is not None:
            assert without.of_one(fact)[1] - size_bits == saved_bits


def test_what_is_rounded_is_less_certain(tmp_path: Path) -> None:
    """A step of 10 adds a variance of 100 / 12 = 8.33: of a standard deviation of 4 it makes sqrt(24.33) = 4.93."""
    tbox = tbox_of(tmp_path)
    turbidity = tbox.attribute_named("turbidity").uid
    ((_, _, value, sigma),) = Detail(tbox, lambda: 5, 4).of([(AUV, turbidity, 337.0, 4.0)])
    assert (value, sigma) == (340.0, pytest.approx(math.sqrt(16.0 + 100.0 / 12.0)))
    facts = [(AUV, turbidity, 337.0, 4.0)]
    assert Detail(tbox, lambda: 4, 4).of(facts) is facts
    battery = [(AUV, tbox.attribute_named("batteryFraction").uid, 0.57)]
    assert Detail(tbox, lambda: 5, 4).of(battery) is battery


def test_what_cannot_be_recorded_is_refused_as_ever(tmp_path: Path) -> None:
    tbox = tbox_of(tmp_path)
    wrong = (AUV, tbox.attribute_named("turbidity").uid, 1001.0)
    assert list(Detail(tbox, lambda: 5, 4).of([wrong])) == [wrong]
