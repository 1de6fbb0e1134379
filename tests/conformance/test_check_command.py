"""``remoras check KIND NAME``: plug-ins that pass, plug-ins that fail, unknown names."""

import pytest
from click.testing import Result
from test_sensors_conform import Sounding
from typer.testing import CliRunner

from remoras.cli import app
from remoras.database import VehicleData
from remoras.sensor import SensorSettings
from remoras.testing import KINDS, conforms


def check(*words: str) -> Result:
    return CliRunner().invoke(app, ["check", *words])


def test_a_shipped_model_passes_every_check() -> None:
    done = check("channel", "perfect")
    assert (done.exit_code, done.stdout.splitlines()) == (0, [f"ok  {name}" for name in conforms("channel", "perfect")])


@pytest.mark.parametrize("kind", [*KINDS, "gadget"])
def test_an_unknown_name_to_check_is_reported_in_one_line(kind: str) -> None:
    done = check(kind, "nosuch")
    (line,) = done.stderr.splitlines()
    assert (done.exit_code, "nosuch" in line or "gadget" in line) == (2, True)
    assert line.count("allowed") <= 1


class SoundingSettings(SensorSettings):
    """A sensor that keeps to the rules."""

    def make(self, data: VehicleData) -> Sounding:
        return Sounding()


def test_a_sensor_is_checked_by_its_settings() -> None:
    done = check("sensor", "test_check_command:SoundingSettings")
    assert (done.exit_code, done.stdout) == (0, f"ok  {next(conforms('sensor', f'{__name__}:SoundingSettings'))}\n")
    assert "swath_m, speed_limit_mps without a default" in check("sensor", "mapping").stderr


def test_a_failed_check_names_its_rule() -> None:
    done = check("policy", "nonconforming_values:Nameless")
    assert done.exit_code == 1
    assert done.stderr.startswith("remoras: policy nonconforming_values:Nameless does not conform: ")
