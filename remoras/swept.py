"""Results of a sweep for scripts and notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from remoras.cards import card

if TYPE_CHECKING:
    from pandas import DataFrame

    from missions.metric import Metric
    from missions.sweeps.folder import SweepResults
    from visualisation.page import CaptionedFigure


class Sweep:
    """Runs of a study, in their folder."""

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
        """Numbers of runs planned, done, failed, censored and remaining."""
        from dataclasses import asdict

        return asdict(self._results.status())

    def runs(self) -> DataFrame:
        """Return a row per finished run: key, configuration, summary."""
        found: DataFrame = self._results.runs()
        return found

    def compare(self, *metrics: str | Metric, baseline: str | None = None) -> DataFrame:
        """Return a row per configuration and metric: mean, interval, difference to the baseline.

        Args:
            metrics: fields of the summary; or your own, as ``"mine.py:MINE"`` or the object, from stored tables; all of
                the study if left out.
            baseline: a strategy or policy; None for that of the study, or its first.

        Raises:
            OutputError: no finished run, an unknown name, or no stored tables.
            PluginError: your own metric cannot be loaded, or fails.
        """
        from dataclasses import asdict

        import pandas as pd

        from missions.comparison import compare as compared

        return pd.DataFrame([asdict(row) for row in compared(self._results, metrics, baseline)])

    def plot(
        self, kind: str | Metric = "overview", metric: str | Metric = "mission_time_s", width_in: float | None = None
    ) -> CaptionedFigure:
        """Draw a figure of the sweep; its ``.caption`` has n, seeds and intervals.

        Args:
            kind: differences, ranking, trade-off, overview; a metric or its chart; or your own.
            metric: metric of differences or ranking, as in ``compare``.
            width_in: None for a column or page of a paper.

        Raises:
            DrawingError: unknown kind, nothing to draw, or several figures.
            OutputError: no finished run, or an unknown metric.
        """
        from visualisation.sweeps import sweep_picture

        results, (ranked, asked) = self._results.naming([metric, kind])
        return sweep_picture(results, asked, ranked, width_in).shown()
