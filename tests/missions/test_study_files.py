"""Study files: varied factors, factorial designs, refusals."""

import itertools
from pathlib import Path

import pytest
from sweeping import study_text, written

from missions.errors import ConfigurationError
from missions.files import shipped_studies
from missions.sweeps.factorial import HIGH, LOW, FactorialDesign, designed, most_halvings
from missions.sweeps.study import Study, load_study

BASE = """
[study]
name = "s"
scenario = "mapping-rendezvous"
repeats = 2
"""


def loaded(tmp_path: Path, text: str) -> Study:
    return load_study(str(written(tmp_path, text)))


def test_cross_product_of_factors_gives_the_configurations(tmp_path: Path) -> None:
    study = loaded(tmp_path, study_text(extra="[grid]\nmission.patience_s = [30, 60, 90]\n"))
    assert len(study.configurations) == 2 * 2 * 3
    chosen = {
        (c.scenario.communication.policy, c.scenario.channel.per, c.scenario.mission.patience_s)
        for c in study.configurations
    }
    assert len(chosen) == 12
    assert all(c.scenario.scenario.duration_s == 20 for c in study.configurations)


def test_latin_hypercube_hits_every_stratum_once_and_is_reproducible(tmp_path: Path) -> None:
    text = BASE + 'sampling = "latin"\nsamples = 8\n[latin]\nchannel.per = [0.0, 0.8]\nmission.patience_s = [20, 100]\n'
    text += "fleet.size = [4, 7]\n"
    first, second = loaded(tmp_path, text), loaded(tmp_path, text)
    assert first.configurations == second.configurations
    rates = [c.scenario.channel.per for c in first.configurations]
    assert sorted(int(rate / 0.1) for rate in rates) == list(range(8))
    patience_s = [c.scenario.mission.patience_s for c in first.configurations]
    assert sorted(int((value - 20) / 10) for value in patience_s) == list(range(8))
    sizes = sorted(len(c.scenario.vehicle) for c in first.configurations)
    assert sizes == [4, 4, 5, 5, 6, 6, 7, 7]  # between whole numbers


def test_sampling_list_uses_its_points_unchanged(tmp_path: Path) -> None:
    text = (
        BASE + 'sampling = "list"\n[[point]]\nchannel.per = 0.1\n[[point]]\nchannel.per = 0.2\nscenario.tick_s = 0.5\n'
    )
    found = [(c.scenario.channel.per, c.scenario.scenario.tick_s) for c in loaded(tmp_path, text).configurations]
    assert found == [(0.1, 1.0), (0.2, 0.5)]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (('"remoras"]', '"remora"]'), "study.toml:5: study.strategies | did you mean 'remoras'"),
        (('"mps-ack"', '"mps-nack"'), "study.toml:6: study.policies"),
        (("[0.1, 0.4]", "[]"), "channel.per = []: no values"),
        (("[0.1, 0.4]", "[0.1, 0.4, 0.10]"), "channel.per = [0.1, 0.4, 0.1]: a value is listed twice"),
        (
            ("[set]", "[grid]\ndecision.weight_external = [0, 2, 0]\n[set]"),
            "grid.decision.weight_external = [0, 2, 0]: a value is listed twice",
        ),
        (("[set]", "[sets]"), "did you mean 'set'"),
        (("seed = 7", 'seed = 7\nsampling = "latin"'), "needs [latin], which is missing"),
        (
            ("seed = 7", "seed = 7\nvehicles = [3, 8]"),
            "study.toml:9: study.vehicles = 3: allowed: 4, the vehicles that a",
        ),
        (("seed = 7", "seed = 7\nvehicles = [8, 8]"), "study.vehicles = [8, 8]: a value is listed twice"),
        (("seed = 7", 'baseline = "ack-repeat"'), "study.baseline"),
        (("seed = 7", 'baseline = "per=0.2"'), "study.baseline | allowed: remoras, ack, mps-ack, per=0.1, per=0.4"),
        (("[set]", '[stopping]\nmetric = "n"\nhalf_width = 1\nminimum = 2\nmaximum = 3\n[set]'), "stopping.metric"),
        (
            ("[set]", '[stopping]\nmetric = "n_bytes"\nmaximum = 30\n[set]'),
            "half_width: missing; give it, or half_w",
        ),
        (
            ("[set]", '[grid]\nstrategy.name = ["central"]\n[set]'),
            'grid.strategy.name = ["central"]: is set by study.strategies too',
        ),
        (
            ('"mapping-rendezvous"', '"mapping-rendezvou"'),
            "study.toml:4: study.scenario | did you mean 'mapping-rendezvous'",
        ),
        (("seed = 7", 'seed = 7\nsampling = "latin"\n[latin]\nmission.patience_s = [true, false]'), "two numbers"),
    ],
)
def test_faulty_study_is_refused_with_file_line_and_key(tmp_path: Path, change: tuple[str, str], expected: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        loaded(tmp_path, study_text().replace(*change))
    assert all(part in str(caught.value) for part in expected.split(" | "))


def test_faulty_table_among_several_is_named_with_its_number(tmp_path: Path) -> None:
    second = '[[channel]]\nname = "bernoulli"\nper = [1.5]\n\n[set]'
    with pytest.raises(ConfigurationError, match=r"study.toml:17: channel.2.per = 1.5"):
        loaded(tmp_path, study_text().replace("[set]", second))
    points = 'sampling = "list"\n[[point]]\nscenario.tick_s = 0.5\n[[point]]\nscenario.tick_s = 5.0\n'
    with pytest.raises(ConfigurationError, match=r"study.toml:10: point.2.scenario.tick_s = 5"):
        loaded(tmp_path, BASE + points)


def test_a_single_channel_needs_no_list(tmp_path: Path) -> None:
    text = study_text().replace("[[channel]]", "[channel]")
    assert loaded(tmp_path, text).configurations == loaded(tmp_path, study_text()).configurations
    with pytest.raises(ConfigurationError, match=r"study.toml:13: channel.per = 1.4"):
        loaded(tmp_path, text.replace("[0.1, 0.4]", "[0.1, 1.4]"))


@pytest.mark.slow
@pytest.mark.parametrize("name", list(shipped_studies()))
def test_every_shipped_study_loads(name: str) -> None:
    assert load_study(name).configurations


MANY = """[study]
scenario = "mapping-rendezvous"
repeats = 2
strategies = ["remora"]
sampling = "latin"
samples = "many"
[latin]
decision.weight_external = [1, 0]
[stopping]
metric = "goal"
[[unforeseen]]
nme = "x"
"""
ONE = """[study]
name = "bad"
scenario = "mapping-rendezvous"
strategies = ["remoras", "cbba"]
baseline = "cbba"
sampling = "list"
repeats = 2
metrics = ["n_bytes"]
[[point]]
channel.per = 0.1
[stopping]
metric = "n_bytes"
half_width = 1.0
maximum = 10
"""
MALFORMED = "1 study.name, 6 study.samples, 9 stopping.maximum, 11 unforeseen.1.name, 12 unforeseen.1.nme"
BETWEEN = """[study]
name = "bad"
scenario = "mapping-rendezvous"
repeats = 2
strategies = ["remora"]
sampling = "latin"
[latin]
decision.weight_external = [1, 0]
[stopping]
metric = "goal"
maximum = 10
"""


@pytest.mark.parametrize(
    ("text", "was", "now", "told"),
    [
        (MANY, "", "", MALFORMED), (BETWEEN, "", "", "8 latin.decision.weight_external, 9 stopping.half_width"),
        (ONE, '"remoras", "cbba"]', '"remoras", 3]', "4 study.strategies.2"),  # so nothing is said of the baseline
        (ONE, "maximum = 10", "maximum = 1", "14 stopping.maximum"),
    ],
)  # fmt: skip
def test_all_independent_faults_of_a_study_are_reported_in_order(
    tmp_path: Path, text: str, was: str, now: str, told: str
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        loaded(tmp_path, text.replace(was, now, 1))
    faults = caught.value.faults
    assert list(faults) == sorted(faults, key=lambda fault: fault.line or 0)
    assert ", ".join(f"{fault.line} {fault.key}" for fault in faults) == told


LETTERS = "abcdefgh"


@pytest.mark.parametrize(
    ("n_factors", "halvings", "resolution"),
    # Box, Hunter, Hunter 2005, table 6.22: the best that there is
    [(3, 1, 3), (4, 1, 4), (5, 1, 5), (5, 2, 3), (6, 1, 6), (6, 2, 4), (6, 3, 3), (7, 1, 7), (7, 2, 4), (7, 3, 4),
     (7, 4, 3), (8, 2, 5), (8, 3, 4), (8, 4, 4)],
)  # fmt: skip
def test_a_fraction_has_the_best_resolution(n_factors: int, halvings: int, resolution: int) -> None:
    design = designed(LETTERS[:n_factors], halvings)
    assert len(design.runs) == 2 ** (n_factors - halvings)
    assert design.resolution == resolution


@pytest.mark.parametrize(("n_factors", "halvings"), [(3, 0), (5, 1), (5, 2), (7, 3)])
def test_factorial_columns_are_balanced_and_aliases_are_exact(n_factors: int, halvings: int) -> None:
    """Two terms are aliases exactly where their columns are the same; all other columns are orthogonal."""
    design = designed(LETTERS[:n_factors], halvings)
    for term in design.terms:
        assert sum(design.column(term)) == 0
        assert set(design.column(term)) == {LOW, HIGH}
    for one, other in itertools.combinations(design.terms, 2):
        product = sum(a * b for a, b in zip(design.column(one), design.column(other), strict=True))
        assert abs(product) == (len(design.runs) if other in design.aliases(one) else 0)


def test_too_many_halvings_are_refused() -> None:
    assert [most_halvings(n) for n in range(2, 9)] == [0, 1, 1, 2, 3, 4, 4]
    for n in range(2, 8):
        with pytest.raises(ValueError, match=f"{n} factors can be halved {most_halvings(n)} times at most"):
            designed(LETTERS[:n], most_halvings(n) + 1)


def test_defining_words_follow_from_the_generators() -> None:
    """For 2^(5-2) with D = AB, E = AC: I = ABD = ACE = BCDE (Box, Hunter, Hunter 2005, section 6.6)."""
    design = FactorialDesign(tuple("ABCDE"), {"D": frozenset("AB"), "E": frozenset("AC")})
    assert design.words == (frozenset("ABD"), frozenset("ACE"), frozenset("BCDE"))
    assert design.aliases(frozenset("A")) == (frozenset("BD"), frozenset("CE"))


STUDY = """
[study]
name = "factors"
scenario = "mapping-patches"
strategies = ["remoras"]
repeats = 2
sampling = "factorial"
halvings = {halvings}

[factorial]
"strategy.parameters.common_plan" = {levels}
"strategy.parameters.announces" = ["next-jobs", "plan"]
"communication.modem" = ["nanomodem-v3", "whoi-fsk-0"]
"""


def study(folder: Path, levels: str = '["none", "missions"]', halvings: int = 1, more: str = "") -> Path:
    path = folder / "study.toml"
    path.write_text(STUDY.format(levels=levels, halvings=halvings) + more)
    return path


def test_a_study_crosses_factors(tmp_path: Path) -> None:
    """A half of 2^3: the modem is the product of the other two."""
    loaded = load_study(str(study(tmp_path)))
    found = {tuple(dict(one.settings).values())[-3:] for one in loaded.configurations}
    assert found == {
        ("none", "next-jobs", "whoi-fsk-0"), ("none", "plan", "nanomodem-v3"),
        ("missions", "next-jobs", "nanomodem-v3"), ("missions", "plan", "whoi-fsk-0"),
    }  # fmt: skip
    assert len(load_study(str(study(tmp_path, halvings=0))).configurations) == 8


@pytest.mark.parametrize(
    ("levels", "halvings", "more", "says"),
    [
        ('["none"]', 0, "", "factorial.strategy.parameters.common_plan.*two levels that differ"),
        ('["none", "missions", "jobs"]', 0, "", "two levels that differ"),
        ('["none", "missions"]', 2, "", "study.halvings = 2: allowed for 3 factors: 0 to 1; with more, main effects"),
        ('["none", "missions"]', 0, '"channel.per" = [0.0, 0.4]', "factorial.channel.per: a condition, not a factor"),
        ('["missions", "jobs"]', 0, "", 'excludes announces = "next-jobs"; allowed: announces = "plan"'),
    ],
)
def test_invalid_factorial_design_is_refused_in_one_line(
    tmp_path: Path, levels: str, halvings: int, more: str, says: str
) -> None:
    with pytest.raises(ConfigurationError, match=says) as caught:
        load_study(str(study(tmp_path, levels, halvings, more)))
    assert len(str(caught.value).splitlines()) == len(caught.value.faults)
