"""Two-level designs: which runs, how well they tell effects apart, and what a study may not ask for."""

import itertools
from pathlib import Path

import pytest

from missions.errors import ConfigurationError
from missions.sweeps.factorial import HIGH, LOW, FactorialDesign, designed, most_halvings
from missions.sweeps.study import load_study

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
def test_every_factor_is_balanced_and_what_is_mixed_is_said(n_factors: int, halvings: int) -> None:
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


def test_words_are_those_of_the_generators() -> None:
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
        ('["none", "none"]', 0, "", "factorial.strategy.parameters.common_plan.*two levels that differ"),
        ('["none", "missions", "jobs"]', 0, "", "two levels that differ"),
        ('["none", "missions"]', 2, "", "study.halvings = 2: allowed for 3 factors: 0 to 1; with more, main effects"),
        ('["none", "missions"]', 0, '"channel.per" = [0.0, 0.4]', "factorial.channel.per: a condition, not a factor"),
        ('["missions", "jobs"]', 0, "", 'excludes announces = "next-jobs"; allowed: "plan", or common_plan'),
        ('["none", "no"]', 0, "", "factorial.strategy.parameters.common_plan.*'none', 'missions' or 'jobs'"),
    ],
)
def test_what_is_no_design_is_refused_in_one_line(
    tmp_path: Path, levels: str, halvings: int, more: str, says: str
) -> None:
    with pytest.raises(ConfigurationError, match=says) as caught:
        load_study(str(study(tmp_path, levels, halvings, more)))
    assert len(str(caught.value).splitlines()) == len(caught.value.faults)
