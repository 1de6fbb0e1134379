"""Keys set from outside that cannot be: one line, with the option, the key, what is given and what is allowed."""

import re

import pytest

from missions.errors import ConfigurationError
from missions.scenarios import load
from missions.scenarios.parts import strategy_of
from remoras.strategies import parameters, strategies
from remoras.strategies.remoras import Remoras

RENDEZVOUS, PATCHES, OBJECTS, TEAMS = "mapping-rendezvous", "mapping-patches", "mapping-objects", "mapping-inspection"
OF_CENTRAL = "central has margin, help_s, acknowledge_rounds, common_plan, announces, repairs, queue"
BAN, LOST = 'issuer="AUV00", vehicle="AUV02"', '{kind="lost",vehicle="AUV01",at_s=300}'
BIAS = 'kind="biased", vehicle="AUV02", at_s=0.0'
CAPABILITIES = (
    "allowed: CommunicationGateway, InspectionPlatform, InterventionPlatform, NavigationAid, SamplingPlatform, "
    "SurveyPlatform; did you mean 'SurveyPlatform'"
)
WINGS = '"Performer", "LeftWinger", "Midfield", "RightWinger"'
NO_HEAD = ";".join([
    'group.Operational.succession=["Cartographer"]', f"vehicle.AUV01.playable_roles=[{WINGS}]",
    f"vehicle.AUV02.playable_roles=[{WINGS}]",
    'vehicle.AUV00.playable_roles=["Tactician", "Coordinator", "LeftWinger"]',
    'vehicle.ASV00.playable_roles=["MissionAdministrator", "Cartographer"]',
])  # fmt: skip
"""Nobody who may play the cartographer is able to lead."""


class Speechless:
    """A strategy that forgot what its vehicles negotiate with, and where it is from."""

    name = "speechless"
    form = staticmethod(Remoras.form)
    adapt = Remoras.adapt


SPEECHLESS = Speechless()


def need(*keys: str, attribute: str = "mappedCell", vehicle: str = "ASV00") -> str:
    of = ", ".join((f"attribute='{attribute}'", f"vehicle='{vehicle}'", "priority=5", *keys))
    return f"need=[{{{of}}}]"


def pruned(**keys: object) -> str:
    given = {"class": "Vehicle", "attribute": "playsRole", "older_than_s": 60.0} | keys
    return f"worldmodel.prune=[{{{', '.join(f'{key} = {value!r}' for key, value in given.items())}}}]"


REFUSED = [  # scenario, settings, what is said
    (RENDEZVOUS, "vehicle.AUV01=1", "names a list"), (RENDEZVOUS, "channel.name.x=1", "channel.name is no table"),
    (RENDEZVOUS, "channel.per", "KEY=VALUE"), (RENDEZVOUS, "=3", "KEY=VALUE"),
    (RENDEZVOUS, "nowhere=1", r"--set \(nowhere\).*unknown key"),
    (RENDEZVOUS, 'channel.blackout=[{from_s=1, until_s=2, between=[["ASV00"], [3]]}]', r"2\.1\) = 3: .*valid string"),
    (RENDEZVOUS, 'group.Operational.succession=["Performr"]', r"Operational\.succession.*Performr.*Performer"),
    (RENDEZVOUS, NO_HEAD, r"Operational\.succession.*nobody can fill it.*Coordinator"),
    (RENDEZVOUS, "decision.weight_continuing=3", r"weight_continuing\) = 3: must be below 3 = 1 \+ weight_external"),
    (RENDEZVOUS, "decision.weight_continuing=1;decision.weight_external=0", r"must be below 1 = 1 \+ weight_ext"),
    (RENDEZVOUS, "guidance.separation_m=0.5", r"--set \(guidance\.separation_m\)"),
    (RENDEZVOUS, "guidance.separation_m=25", r"--set \(guidance\.separation_m\)"),
    (RENDEZVOUS, "damage.share=0.3", r"damage\.share\) = 0\.3: .*crc_bits.*key_file.*damage\.unchecked = true"),
    (RENDEZVOUS, "communication.guard_s=0.7;communication.clocks.apart_s=0.3",
     r"communication.guard_s\) = 0.7: 0.9667 s or more: .* leave the key out"),
    (RENDEZVOUS, "communication.key_file='nowhere.key'", r'\.key_file\) = ".*nowhere\.key": cannot be read'),
    (RENDEZVOUS, "communication.crc_bits=12", r"\(communication\.crc_bits\) = 12: .*0, 8, 16 or 32"),
    # policies
    (RENDEZVOUS, "communication.policy=mps-ak", "allowed: ack, .*did you mean 'mps-ack'"),
    *((RENDEZVOUS, f"communication.policy=conformance.nonconforming_policies:{name}", says) for name, says in (
        ("ONLY_A_KIND", "an exchange.AckPolicy is expected"),
        ("DOUBLE", "the name ack is taken by a shipped policy"),
        ("ANGRY", "its carries must answer for every bit of a header, but raised KeyError: 'frame'"),
    )),
    # strategies
    (PATCHES, f"strategy.name={__name__}:SPEECHLESS",
     f'= "{__name__}:SPEECHLESS": a strategy: lacks declaration, negotiator of remoras.strategy.Strategy'),
    *((PATCHES, f"strategy.name={of};strategy.parameters.{setting}",
       rf"--set \(strategy\.parameters\.{setting.partition('=')[0]}\) = {given}: .*{says}")
      for of, setting, given, says in (
        ("central", "queu=3", "3", f"{OF_CENTRAL}; did you mean 'queue'"),
        ("central", "bundle=3", "3", f"{OF_CENTRAL}$"), ("oracle", "queue=3", "3", "oracle has no parameters"),
        ("central", "queue=0", "0", "greater than or equal to 1"),
        ("central", "queue=65", "65", "less than or equal to 64"), ("central", "queue=true", "true", "valid integer"),
        ("central", "queue={most=3}", '{"most": 3}', "valid integer"),
        ("cbba", "discount_s=0.0", "0.0", "greater than 0"),
        ("fixed-partition", "margin=inf", "Infinity", "less than or equal to 100"),
    )),
    # bans, faults, objects
    (RENDEZVOUS, f"fault=[{LOST}];fault.3.at_s=1", r"'3' is none of 1"),
    (OBJECTS, 'ban=[{issuer="AUV0", vehicle="AUV02", at_s=6.0}]', r"ban\.1\.issuer.*allowed: ASV00.*mean 'AUV0"),
    (OBJECTS, 'ban=[{issuer="AUV00", vehicle="nobody", at_s=6.0}]', r"ban\.1\.vehicle.*allowed: ASV00"),
    (OBJECTS, 'ban=[{issuer="AUV00", vehicle="AUV00", at_s=6.0}]', r"ban\.1\.issuer.*of itself does not count"),
    (OBJECTS, f"ban=[{{{BAN}, at_s=2e4}}]", r"ban\.1\.at_s.*below scenario\.duration_s = 14400"),
    (OBJECTS, f"ban=[{{{BAN}, at_s=9.0, until_s=8.0}}]", r"ban\.1\.until_s.*above at_s = 9"),
    (OBJECTS, f"ban=[{{{BAN}, at_s=9.0, from_s=0.5}}]", r"ban\.1\.from_s"),
    (OBJECTS, f"fault=[{{{BIAS}, offset=[1.0, 0.0]}}]", r"fault\.1\.attribute.*required by kind biased"),
    (OBJECTS, f'fault=[{{{BIAS}, attribute="location"}}]', r"fault\.1\.offset.*required by kind biased"),
    (OBJECTS, f'fault=[{{{BIAS}, attribute="locaton", offset=[1.0, 0.0]}}]', r"attribute.*mean 'location'"),
    (OBJECTS, f'fault=[{{{BIAS}, attribute="location", offset=1.0}}]', r"fault\.1\.offset.*a point: \[east, north\]"),
    (OBJECTS, 'object=[{name="x", position_m=[1.0, 2.0], classification="whale"}]', r"classification"),
    # what world models keep
    (RENDEZVOUS, pruned(**{"class": "Vehikel"}), r'\.class\) = "Vehikel": allowed: Thing.*did you mean \'Vehicle\''),
    (RENDEZVOUS, pruned(attribute="position"), r'prune\.1\.attribute\) = "position": allowed: areaDone'),  # a status
    (RENDEZVOUS, pruned(attribute="type"), r'prune\.1\.attribute\) = "type"'),
    (RENDEZVOUS, pruned(older_than_s=-1.0), r"prune\.1\.older_than_s\) = -1"),
    (RENDEZVOUS, pruned(older=1.0), r"prune\.1\.older\) = 1.*unknown key, allowed here: class, attribute"),
    *((RENDEZVOUS, f"worldmodel.{key}", r"worldmodel\.wait") for key in ("waiting_s=0", "waiting_blocks=0", "waits=1")),
    # capabilities
    (TEAMS, "group.Inspectors.role.InspectionHead.requires.capability=SurveyPlatfrom",
     rf'requires\.capability\) = "SurveyPlatfrom": {CAPABILITIES}'),
    (TEAMS, "vehicle.AUV01.sensor.equipment=SideScan", "SideScanSonar, Sonar"),
    (TEAMS, "vehicle.AUV01.sensor.equipment=AUV", r'sensor\.equipment\) = "AUV": allowed: AcousticModem'),
    # needs
    (RENDEZVOUS, need(attribute="mappedSell"), r'need\.1\.attribute\) = "mappedSell"'),
    (RENDEZVOUS, need('of="Bey"'), r'need\.1\.of\) = "Bey": no class or instance'),
    (RENDEZVOUS, need(vehicle="ASV01"), r'need\.1\.vehicle\) = "ASV01"'),
    (RENDEZVOUS, need("ttl_s=0.0"), r"need\.1\.ttl_s\) = 0\.0: must be above 0: leave it out for no limit"),
    (RENDEZVOUS, need("ttl_s=10.0", "blackout_s=20.0"), r"blackout_s\) = 20\.0: must be below ttl_s = 10, else val"),
    (RENDEZVOUS, need("queue_limit=0"), r"queue_limit\) = 0: must be 1 or more: leave it out for no limit"),
    (RENDEZVOUS, need("ttl_s=60.0", attribute="position"), r"ttl_s\) = 60\.0: limits nothing, for communication\.need"),
    (RENDEZVOUS, need("from_s=90.0", "until_s=80.0"), r"need\.1\.until_s\) = 80\.0: must be above from_s = 90"),
]  # fmt: skip


@pytest.mark.parametrize(("scenario", "settings", "says"), REFUSED, ids=[settings[:60] for _, settings, _ in REFUSED])
def test_what_cannot_be_set_is_refused_in_one_line(scenario: str, settings: str, says: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        load(scenario, [("--set", one) for one in settings.split(";")])
    lines = str(caught.value).splitlines()
    assert len(lines) == 1 or settings is NO_HEAD  # for whom other roles are not filled either
    assert re.search(says, lines[0]), lines


@pytest.mark.parametrize("setting", ["decision.weight_continuing=2.99", "decision.weight_external=50"])
def test_weights_below_the_limit_are_taken(setting: str) -> None:
    """3 is as much as an importance of 1 and the loudest call, 2.0: nothing performed would ever be left."""
    load(RENDEZVOUS, [("--set", setting)])


def test_a_parameter_of_a_strategy_is_set_and_the_others_keep_their_defaults() -> None:
    scenario = load(PATCHES, [("--set", "strategy.name=central"), ("--set", "strategy.parameters.queue=3")])
    defaults, found = (
        {one.name: one.default for one in parameters(strategy)}
        for strategy in (strategies()["central"], strategy_of(scenario))
    )
    assert found == defaults | {"queue": 3} != defaults
