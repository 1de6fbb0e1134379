"""Slot lists that cannot be: one message each, with what is allowed."""

import pytest
from typer.testing import CliRunner

from missions.errors import ConfigurationError
from missions.scenarios import load
from remoras.cli import app

ORDER = '["AUV00", "AUV01", "AUV02", "ASV00"]'


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (['communication.slots=["AUV00","AUV01","AUV2","ASV00"]'], r"AUV2.*allowed: ASV00.*did you mean 'AUV02'"),
        (["communication.slots=[]"], r"communication\.slots.*must have 2 to 32 slots; leave it out"),
        (['communication.slots=["AUV00","AUV01","ASV00"]'], r"leaves out AUV02 with 0 free slots.*add a free slot"),
        (['communication.slots=["AUV00","", "ASV00"]'], r"leaves out AUV01, AUV02 with 1 free slots"),
        (
            ['communication.mac="aloha"', f"communication.slots={ORDER}"],
            r'nobody has a slot by communication\.mac = "aloha": leave the list out, or mac',
        ),
        (
            ['communication.mac="aloha"', f'slots=[{{by="AUV00", at_s=9.0, order={ORDER}}}]'],
            r"slots\.1.*nobody has a slot",
        ),
        (
            ['communication.mac="aloha"', "communication.clocks={discipline=true}"],
            r"communication\.clocks\.discipline.*must be false",
        ),
        ([f'slots=[{{by="AUV00", at_s=2e4, order={ORDER}}}]'], r"slots\.1\.at_s.*below scenario\.duration_s = 14400"),
        ([f'slots=[{{by="AUV0", at_s=9.0, order={ORDER}}}]'], r"slots\.1\.by.*allowed: ASV00"),
        (['slots=[{by="AUV00", at_s=9.0, order=["AUV00", "ASV00"]}]'], r"slots\.1\.order.*must have 4 slots"),
        (
            ['slots=[{by="AUV00", at_s=9.0, order=["AUV00", "ASV00", "AUV01", "AUV01"]}]'],
            r"slots\.1\.order.*leaves out AUV02",
        ),
        (['communication.mac="csma"'], r"communication\.mac"),
    ],
)
def test_what_cannot_be_is_one_message(settings: list[str], says: str) -> None:
    with pytest.raises(ConfigurationError, match=says) as refused:
        load("mapping-rendezvous", [("--set", one) for one in settings])
    assert len(str(refused.value).splitlines()) == 1


def test_scenarios_without_them_do_not_list_them() -> None:
    """So runs and sweeps of before keep their ids."""
    text = load("mapping-rendezvous", []).model_dump_json()
    assert '"slots"' not in text
    assert '"mac"' not in text


@pytest.mark.parametrize("key", ["communication.slots", "communication.mac", "slots.by", "slots.at_s", "slots.order"])
def test_every_key_is_explained(key: str) -> None:
    assert key in CliRunner().invoke(app, ["explain", key]).output
