"""Classification of contacts by the analyst from received strips, and what a view depends on."""

import math

import pytest
from recorded import point
from varied import Varied

from exchange.arithmetic import log

hunted = Varied("minehunting-contacts", "contacts.toml").flown
SHORT = "scenario.duration_s=30.0"


@pytest.mark.slow
def test_classification_follows_from_strips_received_before() -> None:
    """The likelihood ratio is recomputed from the strips that the classifying vehicle held at that time."""
    of = hunted(1)
    decisive = log(0.99 / 0.01)
    came_s = {(row[1], row[2]): row[0] for row in reversed(of.recorder.knowledge) if row[4] in ("received", "observed")}
    said = {row[4]: row for row in reversed(of.recorder.items) if row[5] == "classifiedAs"}
    assert len(said) == 12
    n_sure = 0
    for contact, claim in said.items():
        by, at_s = claim[1], claim[3]
        ratio, strips = 0.0, []
        references: dict[str, tuple[float, float]] = {}
        blocks: dict[str, list[tuple[str, str, str]]] = {}
        for row in of.recorder.items:
            if came_s.get((by, row[0]), math.inf) <= at_s:
                blocks.setdefault(row[0].partition(".")[0], []).append((row[4], row[5], row[6]))
        for facts in blocks.values():
            if any(subject == contact and attribute.startswith("has") for subject, attribute, _ in facts):
                strips.append(facts)
        for facts in strips:
            references |= {
                subject: point(value) for subject, attribute, value in facts if attribute == "referenceLevel"
            }
        for facts in strips:
            for subject, attribute, value in facts:
                if "Echo" in attribute:
                    mean_db = 1.8 if attribute.startswith("target") else 0.6
                    ratio += 2.0 * mean_db / 36.0 * (sum(point(value)) - sum(references[subject]))
        assert (ratio > 0.0) == (claim[6] == "mine")
        n_sure += abs(ratio) >= decisive - 1e-6
    assert n_sure >= 10


@pytest.mark.slow
def test_deaf_analyst_classifies_nothing() -> None:
    """Views are made all the same."""
    of = hunted(1, 'fault=[{kind="deaf",vehicle="ASV00",at_s=1.0}]', "scenario.duration_s=900.0")
    assert not [row for row in of.recorder.rows("classifications") if row[1] == "ASV00"]
    assert not of.completed


@pytest.mark.slow
@pytest.mark.parametrize("fault", ['kind="lost",vehicle="AUV02",at_s=400', 'kind="lost",vehicle="ASV00",at_s=500'])
def test_mission_completes_after_the_loss_of_one_vehicle(fault: str) -> None:
    """Views of a lost vehicle are repeated; the successor of a lost analyst receives the missing strips again."""
    of = hunted(1, f"fault=[{{{fault}}}]")
    assert of.completed
    assert len(of.recorder.rows("classifications")) == 12


def test_view_depends_on_seed_contact_and_number_only() -> None:
    """Not on vehicle, time or losses; other seeds have other mines."""
    mission = hunted(1, SHORT).mission
    assert mission.world(3) == hunted(1, SHORT, "channel.per=0.5").mission.world(3)
    assert len({mission.world(seed).mines for seed in range(20)}) > 10
    assert mission.world(3).strip(0, 2) != mission.world(4).strip(0, 2)
    assert mission.world(3).strip(0, 2) != mission.world(3).strip(1, 2)
