"""Tables of bans and of biases that cannot be: one message each, with what is allowed."""

import pytest

from missions.errors import ConfigurationError
from missions.scenarios import load

BIAS = 'kind="biased", vehicle="AUV02", at_s=0.0'


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ('ban=[{issuer="AUV0", vehicle="AUV02", at_s=6.0}]', r"ban\.1\.issuer.*allowed: ASV00.*did you mean 'AUV0"),
        ('ban=[{issuer="AUV00", vehicle="nobody", at_s=6.0}]', r"ban\.1\.vehicle.*allowed: ASV00"),
        ('ban=[{issuer="AUV00", vehicle="AUV00", at_s=6.0}]', r"ban\.1\.issuer.*of itself does not count"),
        ('ban=[{issuer="AUV00", vehicle="AUV02", at_s=2e4}]', r"ban\.1\.at_s.*below scenario\.duration_s = 14400"),
        ('ban=[{issuer="AUV00", vehicle="AUV02", at_s=9.0, until_s=8.0}]', r"ban\.1\.until_s.*above at_s = 9"),
        ('ban=[{issuer="AUV00", vehicle="AUV02", at_s=9.0, from_s=0.5}]', r"ban\.1\.from_s"),
        (f"fault=[{{{BIAS}}}]", r"fault\.1\.attribute.*required by kind biased"),
        (f'fault=[{{{BIAS}, attribute="location"}}]', r"fault\.1\.offset.*required by kind biased"),
        (
            f'fault=[{{{BIAS}, attribute="locaton", offset=[1.0, 0.0]}}]',
            r"fault\.1\.attribute.*did you mean 'location'",
        ),
        (f'fault=[{{{BIAS}, attribute="location", offset=1.0}}]', r"fault\.1\.offset.*a point: \[east, north\]"),
        ('fault=[{kind="lost", vehicle="AUV02", at_s=1.0, offset=1.0}]', r"fault\.1\.offset.*only by biased"),
        ('object=[{name="x", position_m=[1.0, 2.0], classification="whale"}]', r"classification"),
    ],
)
def test_what_cannot_be_is_one_message(setting: str, says: str) -> None:
    with pytest.raises(ConfigurationError, match=says):
        load("mapping-objects", [("--set", setting)])


def test_scenarios_without_them_do_not_list_them() -> None:
    """So runs and sweeps of before keep their ids."""
    text = load("mapping-rendezvous", [("--set", 'fault=[{kind="lost", vehicle="AUV02", at_s=1.0}]')]).model_dump_json()
    for word in ('"ban"', '"object"', '"offset"', '"attribute"'):
        assert word not in text
