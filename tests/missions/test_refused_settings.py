"""Refused settings of keys: one line with option, key, value and allowed values."""

import re

import pytest

from missions.errors import ConfigurationError
from missions.scenarios import load
from missions.scenarios.parts import strategy_of
from remoras.strategies import parameters, strategies
from remoras.strategies.remoras import Remoras

RENDEZVOUS, PATCHES, OBJECTS, TEAMS = "mapping-rendezvous", "mapping-patches", "mapping-objects", "mapping-inspection"
OF_CENTRAL = "central has help, margin, join_s, acknowledge_rounds, common_plan, announces, repairs, queue"
SEARCH, ESCORT, FERRY = "arrows-archaeology", "escort-lines", "ferry-passage"
HUNT, RECOVERY, RESUPPLY = "minehunting-contacts", "recovery-field", "resupply-field"
EVEN = [[0.002] * 30] * 20
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
    """Strategy without the class of its negotiations and its reference."""

    name = "speechless"
    form = staticmethod(Remoras.form)
    adapt = Remoras.adapt


SPEECHLESS = Speechless()


NO_CIRCLE, NO_MISSION = "group.Operational.formed_by='Inspectors'", "group.Inspectors.mission='Inspection'"
SEVERAL = (NO_HEAD, NO_CIRCLE, NO_MISSION)
"""Settings that contradict two rules."""


def need(*keys: str, attribute: str = "mappedCell", vehicle: str = "ASV00") -> str:
    of = ", ".join((f"attribute='{attribute}'", f"vehicle='{vehicle}'", "priority=5", *keys))
    return f"need=[{{{of}}}]"


def pruned(**keys: object) -> str:
    given = {"class": "Vehicle", "attribute": "playsRole", "older_than_s": 60.0} | keys
    return f"worldmodel.prune=[{{{', '.join(f'{key} = {value!r}' for key, value in given.items())}}}]"


WITHOUT_SONARS = ";".join(f"vehicle.AUV0{number}.sensor=[]" for number in range(4))
REFUSED = [  # scenario, settings, what is said
    (RENDEZVOUS, "vehicle.AUV01=1", "names a list"), (RENDEZVOUS, "channel.name.x=1", "channel.name is no table"),
    (RENDEZVOUS, "channel.per", "KEY=VALUE"), (RENDEZVOUS, "=3", "KEY=VALUE"),
    (RENDEZVOUS, "nowhere=1", r"--set \(nowhere\).*unknown key"),
    (RENDEZVOUS, 'channel.blackout=[{from_s=1, until_s=2, between=[["ASV00"], [3]]}]', r"2\.1\) = 3: .*valid string"),
    (RENDEZVOUS, 'group.Operational.succession=["Performr"]', r"Operational\.succession.*Performr.*Performer"),
    (RENDEZVOUS, NO_HEAD, r"Operational\.succession.*no vehicle can fill it.*Coordinator"),
    (RENDEZVOUS, "decision.weight_continuing=3", r"weight_continuing\) = 3: must be below 3 = 1 \+ weight_external"),
    (RENDEZVOUS, "guidance.separation_m=0.5", r"--set \(guidance\.separation_m\)"),
    (RENDEZVOUS, "damage.share=0.3", r"damage\.share\) = 0\.3: .*crc_bits.*key_file.*damage\.unchecked = true"),
    (RENDEZVOUS, "communication.key_file='nowhere.key'", r'\.key_file\) = ".*nowhere\.key": cannot be read'),
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
        ("central", "queue=0", "0", "greater than or equal to 1"),
        ("fixed-partition", "margin=inf", "Infinity", "less than or equal to 100"),
    )),
    # bans, faults, objects
    (RENDEZVOUS, f"fault=[{LOST}];fault.3.at_s=1", r"'3' is none of 1"),
    (OBJECTS, 'ban=[{issuer="AUV0", vehicle="AUV02", at_s=6.0}]', r"ban\.1\.issuer.*allowed: ASV00.*mean 'AUV0"),
    (OBJECTS, 'ban=[{issuer="AUV00", vehicle="AUV00", at_s=6.0}]', r"ban\.1\.issuer.*cannot exclude itself"),
    (OBJECTS, f"ban=[{{{BAN}, at_s=2e4}}]", r"ban\.1\.at_s.*below scenario\.duration_s = 14400"),
    (OBJECTS, "current.surge=[{between_s=[2e4, 3e4], lasts_s=9.0}]",
     r"current\.surge\.1\.between_s.*= \[20000\.0, 30000\.0\]: must be below scenario\.duration_s = 14400"),
    (OBJECTS, f"ban=[{{{BAN}, at_s=9.0, until_s=8.0}}]", r"ban\.1\.until_s.*above at_s = 9"),
    (OBJECTS, f"fault=[{{{BIAS}, offset=[1.0, 0.0]}}]", r"fault\.1\.attribute.*required by kind biased"),
    (OBJECTS, f'fault=[{{{BIAS}, attribute="location", offset=1.0}}]', r"fault\.1\.offset.*a point: \[east, north\]"),
    # what world models keep
    (RENDEZVOUS, pruned(**{"class": "Vehikel"}), r'\.class\) = "Vehikel": allowed: Thing.*did you mean \'Vehicle\''),
    (RENDEZVOUS, pruned(attribute="position"), r'prune\.1\.attribute\) = "position": allowed: areaDone'),  # a status
    *((RENDEZVOUS, f"worldmodel.{key}", r"worldmodel\.wait") for key in ("waiting_s=0", "waiting_blocks=0", "waits=1")),
    # applications
    (SEARCH, "search.x_m=[0.0, 1400.0]", r"search\.x_m\) = \[0, 1400\]: within world\.x_m = \[-100, 1300\]"),
    (SEARCH, "search.cell_m=10.0", "= 10: 120 x 80 cells; at most 4096"),
    (SEARCH, "kind.amphorae.map=[[0.1]]", "= 1 rows of 1: 20 rows of 30 numbers"),
    (SEARCH, f"kind.amphorae.map={EVEN}", "= sums to 1.2: shares of all cells sum to 1"),
    (SEARCH, "kind.amphorae.expected=400.0", "things in one cell: at most 1 of all kinds together"),
    (RENDEZVOUS, "finds.number=64;world.cell_m=100", r"number\) = 64: allowed: 0 to 16, the cells of all areas"),
    (RENDEZVOUS, "finds.number=2;finds.close_radius_m=30", r"_m\) = 30: allowed: 2 to world\.cell_m = 25"),
    (RENDEZVOUS, "finds.number=2;finds.longest_stay_s=50", r"stay_s\) = 50: allowed: shortest_stay_s = 60 or more"),
    (TEAMS, "group.Inspectors.formed_by='Operationl'", "allowed: Coordination, Operational; did you mean 'Operat"),
    (TEAMS, NO_CIRCLE, "no group of the circle would ever be there"), (TEAMS, NO_MISSION, "leave it out"),
    (ESCORT, "line.line 1.to_m=[-320.0, -95.0]", "the line is too short; allowed: 10 m or more"),
    (FERRY, "passage.width_m=4.0", r"= 4.0: narrower than the separation; allowed: guidance\.separation_m = 5"),
    (FERRY, "passage.x_m=[40.0, -40.0]", "allowed: the lower end first"),
    (FERRY, "passage.y_m=119.0", r"y_m\) = 119.0: allowed: -117 to 117, so that it lies within the world"),
    (FERRY, "vehicle.AUV00.start_m=[0.0, 0.0]", "in the reef, x -42.5 to 42.5, or its passage"),
    (FERRY, "delivery.load 1.from_m=[10.0, 0.0]", r"= \[10, 0\]: in the reef or its passage"),
    (HUNT, "imagery.target_strips=9", "= 9: allowed: 1 to 8, the strips there are"),
    (HUNT, "mission.revisits=20", r"mission\.view_m = 15.0: its views would be 4.46 m apart; 7 m or more"),
    (HUNT, "contact.contact 2.position_m=[0.0, 0.0];contact.contact 1.position_m=[20.0, 0.0]", "nearer than 45 m to"),
    (RECOVERY, "vehicle.AUV03.depth_m=30", "= 30: allowed: within 3 m of AUV00, 20 m, as helpers find each other by"),
    (ESCORT, "fleet.size=6;fleet.copies_of=AUV04", "AUV05 has depth_m = 24: allowed: within 3 m .* fleet.layers"),
    (RECOVERY, "lifts.vehicles=5", "= 5: an object takes more vehicles than there are; allowed: 1 to 4"),
    (RECOVERY, "lifts.length_m=6.0", "= 6.0: allowed: 8.25 or more, so that vehicles keep clear"),
    (RECOVERY, WITHOUT_SONARS, r"lifts\.number = 4: no vehicle could find one: give a vehicle a sensor"),
    (RESUPPLY, "transfer.berth_m=6.0", "= 6.0: allowed: 8.25 to 20, so that vehicles keep clear"),
    (RESUPPLY, "boring.hole 1.position_m=[-240.0, 93.0]", r"boring\.hole 2\.position_m = .*more than 4 m from hole 1"),
    (RESUPPLY, 'boring.hole 1.drill="saw"', '= "saw": no vehicle has such a drill; allowed: auger, corer'),
    # capabilities
    (TEAMS, "group.Inspectors.role.InspectionHead.requires.capability=SurveyPlatfrom",
     rf'requires\.capability\) = "SurveyPlatfrom": {CAPABILITIES}'),
    (TEAMS, "vehicle.AUV01.sensor.equipment=AUV", r'sensor\.equipment\) = "AUV": allowed: AcousticModem'),
    # needs
    (RENDEZVOUS, need(attribute="mappedSell"), r'need\.1\.attribute\) = "mappedSell"'),
    (RENDEZVOUS, need("ttl_s=10.0", "blackout_s=20.0"), r"blackout_s\) = 20\.0: must be below ttl_s = 10, else val"),
    (RENDEZVOUS, need("ttl_s=60.0", attribute="position"), r"ttl_s\) = 60\.0: limits nothing, for communication\.need"),
]  # fmt: skip


@pytest.mark.parametrize(("scenario", "settings", "says"), REFUSED, ids=[settings[:60] for _, settings, _ in REFUSED])
def test_invalid_setting_is_refused_in_one_line(scenario: str, settings: str, says: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        load(scenario, [("--set", one) for one in settings.split(";")])
    lines = str(caught.value).splitlines()
    assert len(lines) == 1 or settings in SEVERAL
    assert re.search(says, "\n".join(lines)), lines


@pytest.mark.parametrize("setting", ["decision.weight_continuing=2.99", "decision.weight_external=50"])
def test_weights_below_the_limit_are_taken(setting: str) -> None:
    """3 is as much as an importance of 1 and the loudest call, 2.0: nothing performed would ever be left."""
    load(RENDEZVOUS, [("--set", setting)])


def test_setting_one_strategy_parameter_keeps_the_other_defaults() -> None:
    scenario = load(PATCHES, [("--set", "strategy.name=central"), ("--set", "strategy.parameters.queue=3")])
    defaults, found = (
        {one.name: one.default for one in parameters(strategy)}
        for strategy in (strategies()["central"], strategy_of(scenario))
    )
    assert found == defaults | {"queue": 3} != defaults
