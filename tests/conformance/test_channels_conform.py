"""Shipped channel models and an external one conform, and each check detects a model that breaks its rule."""

from collections.abc import Callable
from pathlib import Path

import nonconforming_channels as broken
import pytest

from exchange.channel.acoustic import AcousticChannel
from exchange.channel.models import GilbertElliottChannel, MatrixChannel
from exchange.channel.shipped import CHANNELS
from exchange.channel.trace import TraceChannel
from missions.scenarios.channel import model_named
from remoras.errors import PluginError
from remoras.testing import channels as conformance

LINKS = [{"sender": "A", "receiver": "B", "per": 1.0}, {"sender": "C", "receiver": "A", "per": 0.4}]
RECORDED = str(Path(__file__).parent / "recorded_links.csv")
CONFORMING: dict[str, conformance.Model] = {
    **CHANNELS,
    "trace": TraceChannel(file=RECORDED),
    "acoustic, faint, one fade a packet": AcousticChannel(source_level_db=120.0, fading="packet"),
    "acoustic, fainter, one fade a bit": AcousticChannel(source_level_db=155.0, spreading=2.0, fading="bit"),
    "matrix of two links": MatrixChannel.model_validate({"per": 0.1, "link": LINKS}),
    "long bursts": GilbertElliottChannel(p_good_to_bad=0.01, p_bad_to_good=0.02, per_good=0.0, per_bad=1.0),
    "from outside": broken.Mud(in_mud="A"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CONFORMING)
@pytest.mark.parametrize("check", conformance.CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
def test_every_shipped_model_conforms(check: Callable[[conformance.Model], None], name: str) -> None:
    check(CONFORMING[name])


@pytest.mark.parametrize(
    ("check", "model", "says"),
    [
        (conformance.check_declaration, broken.Untitled, "has no title"),
        (conformance.check_declaration, broken.Unexplained, "setting haste is not described"),
        (conformance.check_declaration, broken.Unset, "setting haste has no default"),
        (conformance.check_declaration, broken.NoMean, "does not define mean_per"),
        (conformance.check_probabilities, broken.Percent, r"20\.0 is no number from 0 to 1"),
        (conformance.check_probabilities, broken.Wordy, "'few' is no number from 0 to 1"),
        (conformance.check_pure, broken.Unrepeatable, "asked again, "),
        (conformance.check_pure, broken.Streamed, "before it was"),
        (conformance.check_mean_per, broken.Optimist, r"mean_per is 0\.1, but 0\.\d+ of 24000 packets are lost"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_channel_model_that_breaks_a_rule_is_detected(check, model, says) -> None:
    with pytest.raises(AssertionError, match=says):
        check(model)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("Untitled", "lacks title"),
        ("NoMean", "lacks mean_per"),
        ("NO_CLASS", "a subclass of .*ChannelModel is needed, not the object of Bernoulli"),
        ("ShortOfArguments", r"link_model.* cannot be called as link_model\(deployment, seed\)"),
        ("NamesVehicle", "rename its setting blackout, a key of every channel"),
        ("Unset", "haste without a default"),
        ("Absent", "Absent"),
    ],
)
def test_an_object_that_is_no_channel_model_is_refused_with_its_missing_parts(name: str, says: str) -> None:
    with pytest.raises(PluginError, match=says):
        model_named(f"nonconforming_channels:{name}")
