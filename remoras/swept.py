"""The Python face of a sweep: the folder of a study, as scripts and notebooks see it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from remoras.cards import card

if TYPE_CHECKING:
    from pandas import DataFrame

    from missions.metric import Metric
    from missions.sweeps.folder import SweepResults
    from visualisation.page import CaptionedFigure


class Sweep:
    """The runs of a study, in their folder.

    Args:
        results: reader of the folder.
    """

    def __init__(self, results: SweepResults) -> None:
        self._results = results

    def __repr__(self) -> str:
        status = self._results.status()
        return f"<Sweep in {self._results.folder}: {status.done} of {status.planned} runs done, {status.failed} failed>"

    def _repr_html_(self) -> str:
        design, status = self._results.file.study, self._results.status()
        rows = [
            ("scenarios", ", ".join(design.scenario)),
            ("strategies", ", ".join(design.strategies or ()) or "that of the scenario"),
            ("metrics", ", ".join(self._results.compared)),
            ("runs", f"{status.done} of {status.planned} done, {status.failed} failed, {status.censored} censored"),
        ]
        return card(f"Sweep {design.name} in {self._results.folder}", rows, "sweep.compare() and sweep.plot() show it")

    @property
    def status(self) -> dict[str, int]:
        """Runs planned, done, failed, censored and remaining."""
        from dataclasses import asdict

        return asdict(self._results.status())

    def runs(self) -> DataFrame:
        """One row for each finished run: key, configuration, summary."""
        found: DataFrame = self._results.runs()
        return found

    def compare(self, *metrics: str | Metric, baseline: str | None = None) -> DataFrame:
        """One row for each configuration and metric: mean, interval, paired difference to the baseline.

        Args:
            metrics: fields of the summary; or your own, as ``"mine.py:MINE"`` or the object, which are read of the
                tables that were kept; those of the study if left out.
            baseline: a strategy or a policy; the study's, or its first, if left out.

        Raises:
            OutputError: nothing has finished, a name is unknown, or no tables were kept.
            PluginError: a metric of your own cannot be had, or fails.
        """
        from dataclasses import asdict

        import pandas as pd

        from missions.comparison import compare as compared

        return pd.DataFrame([asdict(row) for row in compared(self._results, metrics, baseline)])

    def plot(
        self, kind: str | Metric = "overview", metric: str | Metric = "mission_time_s", width_in: float | None = None
    ) -> CaptionedFigure:
        """A figure of the sweep.

        Args:
            kind: differences, ranking, trade-off, overview, or a metric by its field or the name of its chart, or your
                own.
            metric: field of the summary whose differences or ranking are drawn, or your own, see ``compare``.
            width_in: of the figure; a column or a page of a paper if left out.

        Returns:
            A Matplotlib figure, see ``Run.plot``; its ``.caption`` has n, seeds and intervals.

        Raises:
            DrawingError: the kind is not known, has nothing to draw, or takes several figures.
            OutputError: no run has finished, or the metric is not known.
        """
        from visualisation.sweeps import sweep_picture

        results, (ranked, asked) = self._results.naming([metric, kind])
        return sweep_picture(results, asked, ranked, width_in).shown()
