"""User errors of every command: exit 2, one line with the allowed values, one JSON value with --json."""

import json
import re
import shlex
import sys
from pathlib import Path

import pytest

from remoras.cli import main

LONG, WORDS = "x" * 10_000, "'" + "many words " * 1000 + "'"
AGO = "2020-01-01T00:00:00+00:00"
MINE, NODE, PATCHES = "run mapping-rendezvous", "node mapping-rendezvous AUV00", "run mapping-patches"
SWARM, BENCHMARK = "swarm mapping-rendezvous", "benchmark fathom-2 --strategy cbba"
RACE = "race mapping-rendezvous"
NO_JSON = ("new", "plot", "replay", "report", "live")
WRONG = [
    ("frobnicate", "No such command 'frobnicate'; see: remoras --help"),
    ("run", "Missing argument"),
    (f"{MINE} --sed 1", "No such option"),
    (f"{MINE} --seed -1", "--seed"),
    ("list a b", "unexpected extra argument"),
    ("list foo", "allowed are scenarios"),
    ("explain comunication.policy", "did you mean 'communication.policy'"),
    ("explain world --schema", "applies to a whole file, scenario or study, not to 'world'"),
    ("new study mine", "remoras new study --example > mine.toml"),
    ("validate nope.toml", "no such file$"),
    ("validate strategies-quick --set seed=2", "--set seed=2: applies to a scenario, and strategies-quick is a study"),
    ("run nope", "a TOML file or one of arrows-archaeology, "),
    ("run strategies-quick", "this is a study; start it with: remoras sweep strategies-quick --out DIR"),
    (f"{MINE} --strategy remora", "--strategy.*'remoras'"),
    (f"{MINE} --per 1", "--per.* = 1.*less than 1$"),
    (f"{MINE} --per 70", "less than 1; 70 % is 0.7$"),
    (f"{MINE} --set scenario.tick_s=60", r"scenario.tick_s. = 60: input should be less than or equal to 1$"),
    (f"{MINE} --set scenario=1", "scenario. = 1: input should be a table$"),
    (f"{MINE} --set communication.needs=1", "communication.needs. = 1: input should be a table$"),
    (f"{MINE} --per 60%", "valid number, without quotes, unit or %$"),
    (f"{MINE} --per half", '--per.*"half".*number'),
    (f"{MINE} --set channel.pre=0.1", "--set.*did you mean 'per'"),
    (f"{MINE} --set vehicle.AUV3.slot=1", "AUV3.*none of ASV00"),
    (f"{MINE} --set nonsense", "KEY=VALUE"),
    (f"{MINE} --strategy \udcc3\udca9", "is no text in UTF-8; set LC_ALL=C.UTF-8"),
    (f"{MINE} --per 0.2 --set channel.per=0.5", "--set = channel.per=0.5: contradicts --per, which sets channel"),
    (f"{MINE} --channel perfect --per 0.5", "--per .channel.per. = 0.5: not used by the perfect channel"),
    (f"{PATCHES} --network mission-2021", "did you mean 'mission-2012'"),
    (f"{PATCHES} --network mission-2012 --channel perfect", "contradicts --channel"),
    ("sweep mapping-rendezvous --out nowhere", "this is a scenario; start it with: remoras run mapping-rendezvous"),
    ("sweep strategies-quick", "--out DIR is missing"),
    ("sweep --out nowhere --status", "no results of a sweep"),
    ("compare nowhere", "no results of a sweep"),
    ("compare . goal_fraction", r"^remoras: \.: no results of a run"),
    ("race nowhere", "a TOML file or one of arrows-archaeology, "),
    (f"{RACE} --only --strategy cbba", "--strategy cbba: a race takes at least two strategies"),
    (f"{RACE} --strategy cbb", '--strategy "cbb": allowed: cbba, '),
    (f"{RACE} --strategy nope.py:X", '--strategy "nope.py:X": no such file'),
    (f"{RACE} --strategy oracle", "--strategy oracle: an upper bound"),
    (f"{RACE} --per 0.2,1.5", r"--per .channel.per. = 1.5: input should be less than 1"),
    (f"{RACE} --budget 79", "--budget 79: allowed: 80 runs or more, 8 of each strategy at each loss"),
    (f"{RACE} --time soon", "--time soon: allowed: a duration as 90s, 2m or 1h"),
    (f"{RACE} --metric mission_time", "--metric 'mission_time': allowed are .*did you mean 'mission_time_s'"),
    ("plot nowhere", r"no results of a run .* nor of a sweep \(study.json is missing\)"),
    ("report nowhere --out report", r"no results of a run .* nor of a sweep \(study.json is missing\)"),
    ("report nowhere", "Missing option '--out'"),
    ("report nowhere --out page.html", r"--out page\.html: names a file; allowed: a folder$"),
    (f"{MINE} --out run.json", r"--out run\.json: names a file; allowed: a folder$"),
    ("sweep strategies-quick --out runs.parquet", r"--out runs\.parquet: names a file; allowed: a folder$"),
    ("query nowhere 'ASK {}'", "no results of a run"),
    ("export nowhere --format csv", "no results of a run"),
    ("export . --format WRONG", r"value for '--format': 'WRONG' is not one of 'mcap', 'geojson', .*; see: remoras"),
    ("benchmark fathom-3 --strategy cbba --out nowhere", "one of fathom-2"),
    (f"{BENCHMARK} --split tset --out nowhere", "--split"),
    (BENCHMARK, "--out DIR is missing"),
    ("benchmark fathom-2 --out nowhere", "--strategy NAME is missing"),
    ("benchmark fathom-2 --strategy cbb --out nowhere", '--strategy "cbb"'),
    ("check strategy nope", "strategy 'nope': allowed: cbba, "),
    ("check stratgy cbba", "kind 'stratgy'"),
    ("exchange-study --policies nope", "nope"),
    ("exchange-study --nodes 1 --bound --out nowhere", "nodes is 1: allowed are 2 to 64"),
    ("sea --describe mission-2021", "allowed are ahoi, .*did you mean 'mission-2012'"),
    ("sea --describe none.csv", "cannot be read: No such file"),
    ("sea --describe mission-2012 --ranges 5", "--ranges: applies to the modems of a scenario"),
    ("sea --describe --modem s2c-18-34", "set channel.source_level_db"),
    ("sea --describe --ranges far", "--ranges 'far': allowed are metres"),
    ("sea --describe --ranges 0,100", "above 0 and at most 100000"),
    ("sea --describe --set channel.spreading=3", "less than or equal to 2"),
    (
        "sea --describe --set channel.name=trace",
        "--set = channel.name=trace: contradicts sea, which sets channel.name too",
    ),
    ("sea --describe --set \"channel={name='perfect'}\"", "--set: sea describes the channel acoustic, not perfect"),
    ("export nowhere", "Missing option '--format'. Choose from: mcap, geojson"),
    ("node", "SCENARIO and VEHICLE are needed"),
    ("node mapping-rendezvous AUV0", "VEHICLE = AUV0: one of ASV00, AUV00"),
    ("node --replay nowhere.jsonl", "nowhere.jsonl"),
    (f"{NODE} --peers AUV9=127.0.0.1:1", "--peers 'AUV9': allowed are ASV00, AUV01, AUV02"),
    (f"{NODE} --speed 0", "--speed 0: allowed is more than 0"),
    (f"{NODE} --drop 1.5", "--drop 1.5: allowed is a share"),
    (f"{NODE} --resume", "--resume: --out is missing"),
    (f"{NODE} --serial /dev/null", "--serial: --start-utc is missing"),
    (f"{NODE} --serial /dev/null --bind 127.0.0.1:47000", "only one of --serial, --unet, --bind and --peers"),
    (f"{NODE} --start-utc soon", "--start-utc 'soon': allowed is a time of ISO 8601"),
    (f"{NODE} --start-utc {AGO}", "the mission was over"),
    (f"{SWARM} --until 1e9", r"--until = 1e\+09: a time up to scenario.duration_s = 14400 s"),
    (f"{SWARM} --vehicles AUV7", "VEHICLE = AUV7: one of ASV00"),
    (f"{SWARM} --set strategy.name=oracle", "strategy.name = oracle: a bound without packets"),
    ("new scenario", "NAME is missing"),
    ("new organization --example", "did you mean 'organisation'"),
    ("new scenario mine --example", "an example has no name"),
    ("new scenario ../up", r"NAME '\.\./up': allowed: up to 40 letters"),
    ("new scenario mapping-rendezvous", "is the name of a shipped scenario"),
    ("new scenario a --vehicles 1", "'--vehicles': '1': Input should be greater than or equal to 2"),
    ("new scenario a --side nan", "--side = nan: allowed: 50 to 1000"),
    ("new scenario a --modem loud", "--modem 'loud': allowed are nanomodem-v3, "),
    ("new scenario a --lost 3", "--lost = 3: allowed: 0 to 2, "),
    (
        "new scenario a --side 900",
        "--side = 900: allowed: a shorter side, .* is 2687 m away, and nanomodem-v3 carries 2000 m",
    ),
    ("new boat a", "kind 'boat': allowed are scenario, strategy, mission, sensor, metric"),
    ("new metric numpy", "NAME 'numpy': a module of that name is installed"),
    ("new metric Mine", "NAME 'Mine': is no name of a module"),
    ("new metric mine --per 0.3", "--per: applies to scenarios; a metric has no such option"),
    (LONG, "xxx"),
    (f"run {LONG}", "xxx"),
    (f"{MINE} --set channel.per={LONG}", "xxx"),
    (f"exchange-study --per {WORDS}", "many words"),
    (f"new metric {LONG}", "xxx"),
]


@pytest.mark.parametrize(("words", "says"), WRONG, ids=[words[:60] for words, _ in WRONG])
def test_a_user_error_is_one_line_and_one_json_value(
    words: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = shlex.split(words)
    has_json = arguments[0] not in NO_JSON
    monkeypatch.setattr(sys, "argv", ["remoras", *arguments, *(["--json"] if has_json else [])])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr()
    assert ended.value.code == 2
    assert re.match(r"remoras: [^\n]+\n\Z", said.err), said.err
    assert re.search(says, said.err)
    assert len(said.err) < 1500
    assert len(said.out) < 3000
    if has_json:
        assert json.loads(said.out)["error"]
    else:
        assert said.out == ""
    assert list(tmp_path.iterdir()) == []
