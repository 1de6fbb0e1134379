"""Belief maps: Bayesian updates, independence of order, error rates of detectors, the drawn map."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure as Sheet
from plain_style import PlainStyle
from searching import Facts, mission, run

from missions.arrows.belief_map import (
    CONTACT,
    SWEPT,
    CellGrid,
    contact_code,
    contact_of,
    disagreement,
    divergence,
    log2_of,
    look_information,
    posterior,
    swept_code,
    swept_of,
)
from missions.arrows.detectors import (
    AcousticSettings,
    ClassifyingCameraSettings,
    DetectorSettings,
    MagneticSettings,
    shown_of,
)
from missions.arrows.scenario import SITES
from missions.arrows.truth import LEVELS, draw_maps, looks_known, sites_of
from missions.runs.results import MemoryResults
from remoras.sensor import Pose

RATES = np.array([[0.1, 0.5, 0.9], [0.02, 0.3, 0.6]])
"""Of two detectors: for nothing and two kinds."""
SHARES = st.lists(st.floats(0.01, 1.0), min_size=3, max_size=3).map(lambda w: np.array([w]).T / sum(w))


def counted(looks: list[tuple[int, bool]]) -> tuple[np.ndarray, np.ndarray]:
    n_yes, n_no = np.zeros((2, 1), dtype=np.int64), np.zeros((2, 1), dtype=np.int64)
    for detector, answer in looks:
        (n_yes if answer else n_no)[detector, 0] += 1
    return n_yes, n_no


LOOKS = st.lists(st.tuples(st.integers(0, 1), st.booleans()), max_size=12)


@given(SHARES, LOOKS)
def test_map_equals_bayes_rule_look_by_look(prior: np.ndarray, looks: list[tuple[int, bool]]) -> None:
    expected = prior[:, 0].copy()
    for detector, answer in looks:
        expected *= RATES[detector] if answer else 1.0 - RATES[detector]
        expected /= expected.sum()
    assert posterior(prior, RATES, *counted(looks))[:, 0] == pytest.approx(expected, rel=1e-9)


@given(st.floats(1e-300, 1e300))
def test_logarithm_equals_that_of_the_library(x: float) -> None:
    assert log2_of(np.array([x]))[0] == pytest.approx(math.log2(x), rel=1e-14, abs=1e-15)


@given(SHARES)
def test_information_of_a_look_equals_the_mean_divergence(prior: np.ndarray) -> None:
    """Mutual information is the mean divergence of the map after the look from the one before."""
    for detector in (0, 1):
        expected = 0.0
        for answer in (True, False):
            after = posterior(prior, RATES, *counted([(detector, answer)]))
            rates = RATES[detector] if answer else 1.0 - RATES[detector]
            expected += float((prior[:, 0] * rates).sum()) * divergence(after, prior)
        assert look_information(prior, RATES[detector])[0] == pytest.approx(expected, abs=1e-12)


@given(SHARES, SHARES)
def test_disagreement_is_symmetric_and_at_most_one_bit_per_cell(one: np.ndarray, other: np.ndarray) -> None:
    assert 0.0 <= disagreement([one, other]) <= 1.0 + 1e-12
    assert disagreement([one, one.copy()]) == pytest.approx(0.0, abs=1e-12)
    assert disagreement([one, other]) == pytest.approx(disagreement([other, one]), abs=1e-12)


GRID = CellGrid(-10.0, 5.0, 10.0, 7, 9)


def test_every_cell_is_in_one_tile() -> None:
    cells = [cell for tile in range(GRID.n_tiles) for cell in GRID.cells_of(tile, 0xFFFF)]
    assert sorted(cells) == list(range(GRID.n_cells))


@given(st.integers(0, GRID.n_cells - 1))
def test_cell_follows_from_its_centre_and_from_its_bit(cell: int) -> None:
    assert GRID.cell_at(GRID.centre_m(cell)) == cell
    tile, bit = GRID.tile_of(cell)
    assert list(GRID.cells_of(tile, 1 << bit)) == [cell]


@given(st.integers(0, 31), st.integers(0, 1), st.integers(0, 255), st.integers(0, 65535), st.integers(0, 4095))
def test_codes_of_passes_and_contacts_decode_to_the_same_values(
    n: int, detector: int, tile: int, mask: int, cell: int
) -> None:
    assert swept_of(swept_code(n, detector, tile, mask)) == (detector, tile, mask)
    assert contact_of(contact_code(2 * n, detector, cell)) == (detector, cell)


@given(st.floats(-20.0, 80.0), st.floats(-5.0, 100.0), st.floats(0.0, 40.0))
def test_cells_in_range_are_exactly_those_within_the_distance(x_m: float, y_m: float, range_m: float) -> None:
    near = set(GRID.near((x_m, y_m), range_m))
    for cell in range(GRID.n_cells):
        at_m = GRID.centre_m(cell)
        squared = (at_m[0] - x_m) ** 2 + (at_m[1] - y_m) ** 2
        if abs(squared - range_m**2) > 1e-6:
            assert (cell in near) == (squared < range_m**2)


def looks(seed: int) -> list[tuple[str, str, int]]:
    draw = random.Random(seed)
    swept = [
        ("swept", "A", swept_code(n, draw.randrange(2), draw.randrange(40), draw.randrange(65536))) for n in range(30)
    ]
    return [*swept, *(("contact", "B", contact_code(n, 0, draw.randrange(600))) for n in range(9))]


def test_maps_are_equal_bytes_for_any_order_and_repetition_of_looks() -> None:
    """Vehicles receive the same looks in other orders, portions, or twice."""
    told = looks(1)
    charts = []
    for order in range(4):
        draw, chart = random.Random(order), mission().chart()
        facts = Facts({})
        shuffled = told + told[: 5 * order]
        draw.shuffle(shuffled)
        for attribute, vehicle, code in shuffled:
            facts.told.setdefault((attribute, vehicle), set()).add(code)
            if draw.random() < 0.3:
                chart.update(facts, ("A", "B"))
        chart.update(facts, ("A", "B"))
        charts.append(chart.shares.tobytes())
    assert len(set(charts)) == 1
    assert charts[0] != mission().chart().shares.tobytes()


def test_looks_of_a_banned_vehicle_do_not_count() -> None:
    facts, chart = Facts({}), mission().chart()
    for attribute, vehicle, code in looks(2):
        facts.told.setdefault((attribute, vehicle), set()).add(code)
    chart.update(facts, ("A", "B"))
    del facts.told["contact", "B"]
    chart.update(facts, ("A", "B"))
    alone = mission().chart()
    alone.add(SWEPT, facts.told["swept", "A"])
    assert chart.shares.tobytes() == alone.shares.tobytes()
    alone.add(CONTACT, [contact_code(0, 0, 7)])
    assert chart.shares.tobytes() != alone.shares.tobytes()


SEA = mission()
DATA = next(iter(SEA._database.values()))
N_SEEDS = 60


def test_numbers_of_objects_follow_the_prior() -> None:
    """Over seeds, of each kind as many as are expected, within 4 standard errors."""
    counts = [np.bincount([one.kind for one in SEA.world(seed).things.values()], minlength=5) for seed in range(200)]
    prior = SEA.chart().prior
    expected, variance = prior.sum(axis=1), (prior * (1.0 - prior)).sum(axis=1)
    for kind in range(1, 5):
        mean = float(np.mean([one[kind] for one in counts]))
        assert abs(mean - expected[kind]) < 4.0 * math.sqrt(variance[kind] / len(counts))


def swept(seed: int, *kinds: type[DetectorSettings], times: int = 1) -> np.ndarray:
    """Map of a vehicle after lanes over the whole area, with each look applied ``times`` times."""
    world, chart = SEA.world(seed), SEA.chart()
    sensors, now_s = [kind().make(DATA) for kind in kinds], 0.0
    away = Pose(-9000.0, -9000.0, 20.0, 0.0, 1.5)  # from there the last looks are told
    poses = [Pose(float(x_m), 100.0 * lane + 50.0, 20.0, 0.0, 1.5) for lane in range(8) for x_m in range(0, 1200, 6)]
    for pose in [*poses, *[away] * 20]:
        now_s += 4.0
        for observation in (one for sensor in sensors for one in sensor.sense(pose, world, now_s)):
            for _, attribute, value, *_ in observation.facts:
                if attribute in (SWEPT, CONTACT):
                    chart.add(attribute, [int(value)] * times)
    return chart.shares


def misbelieved(times: int) -> float:
    """Of classes of beliefs, the greatest difference of mean belief and share of occupied cells, in standard errors."""
    believed, occupied = [], []
    for seed in range(N_SEEDS):
        believed.append(1.0 - swept(seed, AcousticSettings, MagneticSettings, times=times)[0])
        occupied.append(np.isin(np.arange(SEA.grid.n_cells), list(SEA.world(seed).things)))
    p, is_occupied = np.concatenate(believed), np.concatenate(occupied)
    worst = 0.0
    for low, high in ((0.0, 0.01), (0.01, 0.05), (0.05, 0.2), (0.2, 0.6), (0.6, 0.9), (0.9, 1.0)):
        chosen = (p >= low) & (p < high)
        if chosen.sum() < 20:
            continue
        error = math.sqrt(float((p[chosen] * (1.0 - p[chosen])).sum()))
        worst = max(worst, abs(float(is_occupied[chosen].sum() - p[chosen].sum())) / error)
    return worst


@pytest.mark.slow
def test_beliefs_of_cells_are_calibrated() -> None:
    """Over seeds: the share of occupied cells in each class of beliefs equals the belief, within 4 standard errors."""
    assert misbelieved(times=1) < 4.0


def test_camera_errs_at_its_stated_rate() -> None:
    world, camera = SEA.world(3), ClassifyingCameraSettings().make(DATA)
    thing = next(iter(world.things.values()))
    pose = Pose(*thing.position_m, 20.0, 0.0, 0.0)
    shown = []
    for number in range(2000):
        (observation,) = camera.sense(pose, world, 10.0 * number)
        shown += [shown_of(int(value)) for _, attribute, value, *_ in observation.facts if attribute == "shown"]
    p_right = 1.0 - SEA.scenario.detector.optical.p_false
    share = sum(one == thing.kind for one in shown) / len(shown)
    assert abs(share - p_right) < 4.0 * math.sqrt(p_right * (1.0 - p_right) / len(shown))


STYLE = PlainStyle(**dict.fromkeys(("ASV00", "AUV01", "AUV02", "AUV03"), "#0000ff"))


def test_map_figure_shades_cells_by_belief_and_marks_detected_sites() -> None:
    of, axes = run(), Sheet().subplots()
    caption = draw_maps(axes, MemoryResults(of), STYLE)
    chart, grid = mission().chart(), mission().grid
    for _, attribute, code in looks_known(of.recorder, mission().crew)[""]:
        chart.add(attribute, (code,))
    shares = chart.shares[1:4].sum(axis=0)
    tones = np.searchsorted(LEVELS, shares, side="right").reshape(grid.n_rows, grid.n_columns)
    assert (np.asarray(axes.images[0].get_array()) == tones).all()
    assert len(np.unique(tones)) > 2
    drawn = {line.get_label(): len(line.get_xdata()) for line in axes.lines}
    found, sites = {row[3] for row in of.recorder.rows("contacts") if row[4] in SITES}, sites_of(of)
    assert (drawn["site, detected"], drawn["site, not detected"]) == (len(sites & found), len(sites - found))
    assert {"AUV01", "AUV02", "AUV03"} <= drawn.keys()
    assert f"{len(sites)} true sites, {len(sites & found)} detected" in caption
