"""The seafloor and the detectors: what is drawn has the probabilities that are stated, and maps are calibrated."""

import math

import numpy as np
import pytest
from searching import mission

from missions.arrows.belief_map import CONTACT, SWEPT
from missions.arrows.detectors import (
    AcousticSettings,
    ClassifyingCameraSettings,
    DetectorSettings,
    MagneticSettings,
    shown_of,
)
from remoras.sensor import Pose

SEA = mission()
DATA = next(iter(SEA._database.values()))
N_SEEDS = 60


def test_things_lie_as_often_as_the_prior_says() -> None:
    """Over seeds, of each kind as many as are expected, within 4 standard errors."""
    counts = [np.bincount([one.kind for one in SEA.world(seed).things.values()], minlength=5) for seed in range(200)]
    expected = SEA.prior.sum(axis=1)
    variance = (SEA.prior * (1.0 - SEA.prior)).sum(axis=1)
    for kind in range(1, 5):
        mean = float(np.mean([one[kind] for one in counts]))
        assert abs(mean - expected[kind]) < 4.0 * math.sqrt(variance[kind] / len(counts))


def test_another_seed_lays_other_things_and_the_same_seed_the_same() -> None:
    assert SEA.world(1).things == SEA.world(1).things
    assert SEA.world(1).things != SEA.world(2).things


def swept(seed: int, *kinds: type[DetectorSettings], times: int = 1) -> np.ndarray:
    """The map of a vehicle that went along lanes over the whole area, and took in each look so often."""
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
def test_of_cells_believed_to_hold_something_so_many_do() -> None:
    """Calibration over seeds: in each class of beliefs as many cells are occupied as it says, within 4 errors."""
    assert misbelieved(times=1) < 4.0


@pytest.mark.slow
def test_a_map_that_counts_looks_twice_is_not_calibrated() -> None:
    """What would come of facts without identity: who hears of a look again would take it for another."""
    assert misbelieved(times=2) > 6.0


def test_a_look_is_a_function_of_seed_vehicle_cell_and_number_alone() -> None:
    assert swept(5, AcousticSettings).tobytes() == swept(5, AcousticSettings).tobytes()
    assert swept(5, AcousticSettings).tobytes() != swept(6, AcousticSettings).tobytes()


def test_a_camera_errs_as_often_as_is_stated() -> None:
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


def test_a_camera_that_moves_shows_nothing() -> None:
    world = SEA.world(3)
    assert ClassifyingCameraSettings().make(DATA).sense(Pose(100.0, 100.0, 20.0, 0.0, 1.0), world, 0.0) == []
