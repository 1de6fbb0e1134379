"""The table of ranks."""

from missions.comparison import compare, ranks
from missions.sweeps.folder import SweepResults
from visualisation.sweeps import ranking
from visualisation.sweeps.arrangement import arranged


def test_the_ranking_is_ordered_by_mean_rank_and_marks_the_best(seven: SweepResults) -> None:
    arrangement = arranged(compare(seven, ["n_bytes"]))
    ranked = ranks(seven, "n_bytes")
    means = [mean for _, mean in ranking.ordered(arrangement, ranked)]
    assert means == sorted(means)
    figure = ranking.figure(arrangement, ranked, "bytes sent")
    assert len(figure.axes[0].patches) == sum(rank.among_best for rank in ranked)
