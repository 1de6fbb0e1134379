"""Public API: the functions of ``import remoras`` for scripts and notebooks.

A ``Run`` is a finished run, in memory or in a folder; a ``Sweep`` is the folder of a study. Tables are pandas data
frames with the units of their columns in ``.attrs["units"]``, figures are Matplotlib figures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.disk import holds_sweep
from missions.errors import OutputError, check_name
from missions.files import dotted, keys_of_options, toml_value
from missions.runs.results import MemoryResults, Results
from missions.scenarios import Scenario
from missions.scenarios import load as load_scenario
from remoras.process import Progress, is_watched
from remoras.table import Figures, Records, card, number_text

# Functions import the heavy libraries that they need themselves, so that ``import remoras`` stays fast.
if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from pandas import DataFrame

    import missions.runs.knowledge_at
    import missions.why
    from exchange.channel.network import Network
    from missions.figure import Declared
    from missions.metric import Metric
    from missions.sweeps.folder import SweepResults
    from remoras.stepped import Stepping
    from remoras.strategy import Strategy
    from visualisation.page import CaptionedFigure
    from visualisation.replay import ReplayPage

Settings = Mapping[str, Any] | str | Sequence[str]
"""Scenario keys and values: a table, possibly nested, or ``KEY=VALUE`` texts."""
MOST_JOBS = 1024
HEADLINE = ("strategy", "policy", "channel", "per", "n_vehicles", "completed", "mission_time_s")
"""Fields of a summary that the card of a run shows besides the default metrics of studies."""


def load(
    scenario: str | Path,
    *,
    strategy: str | None = None,
    policy: str | None = None,
    channel: str | None = None,
    network: str | None = None,
    per: float | None = None,
    set: Settings | None = None,
) -> Scenario:
    """Return a validated scenario; raise ConfigurationError with all errors found.

    ``scenario`` is a shipped name, or the path of a TOML file; ``strategy``, ``policy`` and ``channel`` replace its
    own. ``network``: shipped measured network, or a file of one, for the channel of that name. ``per``: packet error
    rate, 0 to below 1. ``set``: other keys and values, as ``{"channel.per": 0.3}`` (tables are merged, lists replaced),
    or texts as on the command line, ``"channel.per=0.3"`` or a list of such.

    >>> load("mapping-rendezvous", per=0.6).channel.per
    0.6
    """
    options = keys_of_options(strategy, policy, channel, network, per)
    overrides = [(name, f"{key}={toml_value(value)}") for name, key, value in options]
    return load_scenario(str(scenario), [*overrides, *_settings(set)])


def _settings(keys: Settings | None) -> list[tuple[str, str]]:
    if isinstance(keys, str):
        return [("set", keys)]
    if isinstance(keys, Mapping):
        return [("set", f"{key}={toml_value(value)}") for key, value in dotted(keys)]
    if keys is not None and not (isinstance(keys, Sequence) and all(isinstance(text, str) for text in keys)):
        raise TypeError(f"set is {keys!r}; allowed: a table of keys and values, 'KEY=VALUE', or a list of these texts")
    return [("set", text) for text in keys or ()]


def scenarios() -> DataFrame:
    """Return title and longest duration (s) of the shipped scenarios, by name.

    >>> float(scenarios().loc["mapping-rendezvous", "duration_s"])
    14400.0
    """
    from missions.files import shipped_abouts

    abouts = {name: {"title": "", **table} for name, table in shipped_abouts().items()}
    return _listed("scenario", abouts)[["title", "duration_s"]]


def policies() -> DataFrame:
    """Return the titles of the shipped acknowledgement policies, by name.

    >>> policies().index[:3].tolist()
    ['ack', 'ack-repeat', 'm-ack']
    """
    from exchange.policy.policies import POLICIES

    return _listed("policy", {name: {"title": policy.title} for name, policy in POLICIES.items()})


def metrics(scenario: str | Path | Scenario = "mapping-rendezvous") -> DataFrame:
    """Return unit, label and better direction of the metrics of a scenario's runs, by name; errors as in ``load``.

    >>> metrics().loc["energy_j", ["unit", "better"]].tolist()
    ['J', 'lower']
    """
    from missions.runs.metrics import metrics_of

    known = metrics_of(scenario if isinstance(scenario, Scenario) else load(scenario))
    return _listed("metric", {name: metric.written() for name, metric in known.items()})[["unit", "label", "better"]]


def _listed(kind: str, rows: Mapping[str, Mapping[str, Any]]) -> DataFrame:
    import pandas as pd

    return pd.DataFrame(list(rows.values()), index=pd.Index(list(rows), name=kind))


def run(
    scenario: str | Path | Scenario,
    *,
    strategy: str | Strategy | None = None,
    policy: str | None = None,
    channel: str | None = None,
    network: str | None = None,
    per: float | None = None,
    seed: int = 1,
    set: Settings | None = None,
) -> Run:
    """Run a scenario to its end in memory; a terminal or notebook shows progress.

    ``scenario`` may be a result of ``load``, which takes no further keys; ``strategy`` an object with the methods of
    ``remoras.Strategy``. Other arguments and errors are those of ``load``. Equal scenarios and ``seed`` give equal
    runs.

    >>> run("mapping-rendezvous", per=0.6, seed=3, set={"scenario.duration_s": 60.0}).summary["completed"]
    False
    """
    from missions.runs.run import run as run_scenario

    loaded, own = _loaded(scenario, strategy, seed, policy, channel, network, per, set)
    table = loaded.scenario
    with Progress(f"run {table.name}", table.duration_s, "s of mission time") as shown:
        report = shown.at if is_watched() else None
        return Run(MemoryResults(run_scenario(loaded, seed, progress=report, strategy=own)))


def stepping(
    scenario: str | Path | Scenario,
    *,
    strategy: str | Strategy | None = None,
    policy: str | None = None,
    channel: str | None = None,
    network: str | None = None,
    per: float | None = None,
    seed: int = 1,
    set: Settings | None = None,
) -> Stepping:
    """Run a scenario tick by tick: ``for state in remoras.stepping("mapping-rendezvous")``.

    Arguments and errors as in ``run``. Returns an iterator of states; its ``run()`` returns the run of ``remoras.run``.

    >>> steps = stepping("mapping-rendezvous", set={"scenario.duration_s": 3.0})
    >>> [state.time_s for state in steps]
    [0.0, 1.0, 2.0, 3.0]
    """
    from remoras.stepped import Stepping

    loaded, own = _loaded(scenario, strategy, seed, policy, channel, network, per, set)
    return Stepping(loaded, seed, own)


def _loaded(
    scenario: str | Path | Scenario,
    strategy: str | Strategy | None,
    seed: int,
    policy: str | None,
    channel: str | None,
    network: str | None,
    per: float | None,
    set: Settings | None,
) -> tuple[Scenario, Strategy | None]:
    from remoras.strategy import faults_of_strategy

    named, own = (strategy, None) if isinstance(strategy, str) else (None, strategy)
    if not isinstance(scenario, Scenario):
        scenario = load(scenario, strategy=named, policy=policy, channel=channel, network=network, per=per, set=set)
    elif any(option is not None for option in (named, policy, channel, network, per, set)):
        raise TypeError("a loaded scenario takes no options beside seed: give them to load()")
    if not isinstance(seed, int) or seed < 0:
        raise TypeError(f"seed is {seed!r}; allowed: a whole number, 0 or more")
    if own is not None and (faults := list(faults_of_strategy(own))):
        raise TypeError(f"strategy {own!r}: {'; '.join(faults)}; give a name, or an object as remoras.Strategy says")
    return scenario, own


def open(folder: str | Path) -> Run | Sweep:
    """Read a run or a sweep from its folder; raise OutputError if it holds neither.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     saved = run("mapping-rendezvous", set="scenario.duration_s=5").save(f"{folder}/dive")
    ...     open(saved).summary["mission_time_s"]
    5.0
    """
    path = Path(folder)
    if holds_sweep(path):
        from missions.sweeps.folder import SweepResults

        return Sweep(SweepResults.read(path))
    return Run(Results.read(path))


def sweep(
    study: str | Path,
    out: str | Path,
    jobs: int = 1,
    strategies: Sequence[str] = (),
) -> Sweep:
    """Make all missing runs of a study in ``out``; the same call resumes an interrupted sweep.

    A study that has grown (repeats, strategies, policies, channels, vehicles, scenarios, points) is extended. ``study``
    is a shipped name, or a TOML file; ``strategies``, as ``["central", "mine.py:Mine"]``, are added to its own. A
    script with more than one process (``jobs``) makes its calls below ``if __name__ == "__main__":``.

    Raises ConfigurationError with all errors of the study, TypeError if ``jobs`` is no number of processes, and
    PartlyDoneError if workers were lost or the disk is full; finished runs are kept.

    >>> from tempfile import TemporaryDirectory
    >>> study = '''
    ... [study]
    ... name = "short"
    ... scenario = "mapping-rendezvous"
    ... strategies = ["remoras", "cbba"]
    ... repeats = 1
    ... [set]
    ... scenario.duration_s = 5.0
    ... '''
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "short.toml").write_text(study)
    ...     sweep(f"{folder}/short.toml", f"{folder}/out").status["done"]
    2
    """
    from missions.sweeps import SweepResults, load_study
    from missions.sweeps import sweep as make

    _check_jobs(jobs)
    loaded = load_study(str(study), strategies)
    with Progress(f"sweep {loaded.design.name}", 1, "runs") as shown:
        make(loaded, Path(out), jobs, progress=shown.at if is_watched() else None)
    return Sweep(SweepResults.read(Path(out)))


def network(name: str | Path) -> Network:
    """Return a measured network: its nodes, and the loss of each link as ``per[sender, receiver]``.

    ``name`` is a shipped network (``remoras list networks``), or a file of one. Raises LinkFileError for an unknown
    network.

    >>> [node.name for node in network("mission-2012").node]
    ['21', '22', '27', '28', '29']
    """
    from exchange.channel.network import network_of

    return network_of(str(name))


def _check_jobs(jobs: int) -> None:
    if isinstance(jobs, bool) or not isinstance(jobs, int) or not 1 <= jobs <= MOST_JOBS:
        raise TypeError(f"jobs is {jobs!r}; allowed: a whole number, 1 to {MOST_JOBS}")


def compare(folder: str | Path, *metrics: str | Metric, baseline: str | None = None) -> DataFrame:
    """Compare the configurations of a sweep; see ``Sweep.compare``.

    >>> from tempfile import TemporaryDirectory
    >>> study = '''
    ... [study]
    ... name = "short"
    ... scenario = "mapping-rendezvous"
    ... strategies = ["remoras", "cbba"]
    ... repeats = 1
    ... [set]
    ... scenario.duration_s = 5.0
    ... '''
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "short.toml").write_text(study)
    ...     _ = sweep(f"{folder}/short.toml", f"{folder}/out")
    ...     compare(f"{folder}/out", "goal_fraction", baseline="cbba")[["strategy", "n", "mean"]].values.tolist()
    [['cbba', 1, 0.0], ['remoras', 1, 0.0]]
    """
    results = open(folder)
    if isinstance(results, Run):
        raise OutputError(f"{folder}: holds a single run; compare takes the folder of a sweep")
    return results.compare(*metrics, baseline=baseline)


def exchange_study(
    nodes: int = 5,
    per: Sequence[float] = (0.1, 0.5),
    policies: Sequence[str] | None = None,
    trials: int = 2000,
    seed: int = 1,
    jobs: int = 1,
) -> DataFrame:
    """Compare acknowledgement policies without a mission: one row per policy and loss rate.

    Rows as in ``remoras exchange-study --json``, with times in TDMA slots. ``nodes`` vehicles send in turn; ``per`` are
    packet error rates, ``policies`` names (None: all), ``jobs`` threads. Raises ExchangeError for a parameter out of
    its range, TypeError for a number or text instead of a list, or if ``jobs`` is no number of threads.

    >>> exchange_study(nodes=3, per=[0.0], policies=["ack"], trials=10)["delivered_slots.mean"].tolist()
    [1.0]
    """
    _check_jobs(jobs)
    for name, value in (("per", per), ("policies", policies)):
        if isinstance(value, float | int | str):
            raise TypeError(f"{name} is {value!r}; allowed: a list, as [{value!r}]")
    import pandas as pd

    from exchange.policy.policies import PAPER_POLICIES
    from exchange.study.parameters import ExchangeStudy
    from exchange.study.study import run as study

    asked = ExchangeStudy(
        nodes=nodes, per=tuple(per), policies=tuple(policies or PAPER_POLICIES), trials=trials, seed=seed
    )
    table: DataFrame = pd.json_normalize([row.as_json() for row in study(asked, jobs)])
    return table


def replay_data(results: Results | MemoryResults) -> bytes:
    """Return the data of a run for its replay page."""
    from missions.scenarios.parts import strategy_of
    from visualisation.replay import run_data

    mission, strategy = results.mission, strategy_of(results.scenario)
    return run_data(results, mission.places, mission.jobs.values(), strategy.declaration.communicates)


class Run:
    """Finished run, in memory or in a folder.

    >>> short: Run = run("mapping-rendezvous", seed=2, set={"scenario.duration_s": 10.0})
    >>> short.seed, short.completed, short.metric("goal_fraction")
    (2, False, 0.0)
    """

    def __init__(self, results: Results | MemoryResults) -> None:
        self._results = results

    def __repr__(self) -> str:
        summary = self.summary
        how = "completed" if summary["completed"] else f"not completed: {summary['reason']}"
        return f"<Run of {summary['scenario']}, seed {summary['seed']}: {how}, {self._results.ended_s:.1f} s>"

    def _repr_html_(self) -> str:
        figures, units = self.summary, self._units()
        headline = {metric.name for metric in self._metrics if metric.headline}
        shown = [name for name in figures if name in HEADLINE or name in headline]
        rows = [(name, number_text(figures[name]), units.get(name, "")) for name in shown]
        rows.append(("tables", ", ".join(self.tables), ""))
        return card(repr(self)[1:-1], rows, "run.summary has all figures, run.plot() and run.replay() show it")

    def _units(self) -> dict[str, str]:
        return {metric.name: metric.unit for metric in self._metrics}

    @property
    def _metrics(self) -> tuple[Metric, ...]:
        from missions.runs.metrics import metrics_of

        return tuple(metrics_of(self.scenario).values())

    @property
    def summary(self) -> dict[str, Any]:
        """Figures of the run, by metric name."""
        return Figures(self._results.summary, self._units)

    @property
    def seed(self) -> int:
        """Seed of the run."""
        return self._results.seed

    @property
    def completed(self) -> bool:
        """True if the mission was completed."""
        return self._results.completed

    def to_xarray(self) -> xarray.Dataset:
        """Return the trajectories by vehicle and time (s): ``position_m`` by axis, and the other columns of the table.

        Units are attributes. Raises ImportError without xarray (extra ``xarray``).
        """
        frame = self.table("trajectories")
        data = frame.set_index(["vehicle", "time_s"]).to_xarray().rename(time_s="time")
        data["position_m"] = data[["x_m", "y_m"]].to_dataarray("axis").transpose("vehicle", "time", "axis")
        data = data.drop_vars(["x_m", "y_m"]).assign_coords(axis=["x", "y"])
        units = {**frame.attrs["units"], "position_m": "m", "time": "s"}
        for name in data.variables:
            data[name].attrs.update({"units": units[name]} if name in units else {})
        names = ("scenario", "strategy", "policy", "channel", "per", "seed")
        return data.assign_attrs({name: self.summary[name] for name in names})

    @property
    def milestones(self) -> list[dict[str, Any]]:
        """Milestones (name, vehicle, group, time_s), in time order."""
        return Records(self._results.summary["milestones"])

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables."""
        return self._results.tables

    def table(self, name: str) -> DataFrame:
        """Return a table as a data frame, units in ``.attrs["units"]``; OutputError if unknown."""
        frame: DataFrame = self._results.table(name).to_pandas()
        frame.attrs["units"] = self._results.units(name)
        return frame

    @property
    def scenario(self) -> Scenario:
        """Complete input of the run."""
        return self._results.scenario

    def plot(
        self,
        kind: str | Declared = "trajectories",
        width_in: float | None = None,
        at_s: float | None = None,
        viewer: str = "",
        panel: str = "",
        ax: Axes | None = None,
    ) -> CaptionedFigure:
        """Draw a figure of the run; return a Matplotlib figure with a ``.caption``.

        ``kind`` is a figure of ``remoras plot`` or of the mission, or your own, as ``"mine.py:MINE"`` or the object; a
        layer or mark is drawn into the trajectories. ``at_s`` and ``viewer``, for the organisation: time, and vehicle
        whose view is drawn; ``panel``: the only panel of the trajectories, such as ``"a"``; ``ax``: axes of your own
        for a panel of the trajectories or a figure of the mission. Raises DrawingError for an unknown kind, or if the
        run lacks its tables, that time, vehicle or panel; PluginError if your own figure cannot be loaded.
        """
        from missions.scenarios.parts import with_figures
        from visualisation.output import KINDS
        from visualisation.runs import run_picture

        mission = self._results.mission
        (asked,), figures = with_figures([kind], mission.figures, KINDS)
        context = figures, mission.places, width_in, at_s, viewer, panel, ax
        return run_picture(self._results, asked, *context).shown()

    def metric(self, metric: str | Metric) -> float | None:
        """Return the value of a metric; None if the run has none.

        ``metric`` is a field of the summary; or your own, as ``"mine.py:MINE"`` or the object. Raises OutputError for
        an unknown field, PluginError if your own metric cannot be loaded, or fails.
        """
        from missions.metric import Absent
        from missions.runs.reader import value_of
        from missions.scenarios.parts import metric_given

        if (own := metric_given(metric, self.summary, "metric")) is not None:
            reference, declared = own
            number = value_of(declared, self._results, reference)
            return None if isinstance(number, Absent) else number
        name = str(metric)
        known = [name for name, value in self.summary.items() if value is None or isinstance(value, float | int)]
        check_name("metric", name, known)
        value: float | None = self.summary[name]
        return value

    def replay(self) -> ReplayPage:
        """Return the replay page, which a notebook displays; DrawingError for a damaged manifest."""
        from visualisation.replay import ReplayPage, page_text, title_of

        return ReplayPage(page_text(title_of([self.summary]), [replay_data(self._results)]))

    def known(self, vehicle: str, at_s: float) -> missions.runs.knowledge_at.KnownAt:
        """Return a vehicle's world model and organisation at ``at_s``; OutputError if unknown."""
        return self._results.known(vehicle, at_s)

    def why(self, vehicle: str, at_s: float, instead: str = "") -> missions.why.Answer:
        """Explain what a vehicle did at ``at_s``, and why not the role or activity ``instead``, if given.

        Raises OutputError for an unknown vehicle, time, role or activity, or without a needed table.
        """
        from missions.why import why

        return why(self._results, vehicle, at_s, instead)

    def export(
        self,
        format: str,
        out: str | Path,
        force: bool = False,
        *,
        vehicle: str | None = None,
        at_s: float | None = None,
    ) -> Path:
        """Write the run for another tool; return the path.

        ``format`` is mcap, geojson, netcdf or csv; or for the knowledge of ``vehicle`` (None: all) at ``at_s`` (None:
        the end) ttl, trig, jsonld or nt. ``out`` is a file, or a folder for csv; ``force`` replaces an earlier export.
        Raises ExportError for an unknown format, missing libraries or data, or an unwritable ``out``; OutputError
        without such a vehicle or time.
        """
        from visualisation.exports import Selection, export

        places, selection = self._results.mission.places, Selection(vehicle, at_s)
        return export(self._results, format, Path(out), force, places, selection).path

    def query(self, sparql: str, *, vehicle: str | None = None, at_s: float | None = None) -> DataFrame:
        """Query the knowledge of one vehicle, or of each, in SPARQL (``worldmodel.rdf.sparql``).

        ``sparql`` is a SELECT or ASK query; ``at_s`` None is the end of the run. Raises OutputError without such a
        vehicle, time or table, QueryError if the query cannot be parsed.
        """
        import pandas as pd

        columns, rows = self._results.query(sparql, vehicle, at_s)
        return pd.DataFrame(rows, columns=list(columns))

    def save(self, folder: str | Path, force: bool = False) -> Path:
        """Write the results to a folder, a new one unless ``force``; OutputError if not possible."""
        if isinstance(self._results, Results):
            raise OutputError(f"the run is in {self._results.folder} already; copy that folder")
        from missions.runs.results import write_results

        write_results(self._results, Path(folder), force)
        return Path(folder)


class Sweep:
    """Runs of a study, in their folder.

    >>> from tempfile import TemporaryDirectory
    >>> study = '''
    ... [study]
    ... name = "short"
    ... scenario = "mapping-rendezvous"
    ... strategies = ["remoras", "cbba"]
    ... repeats = 1
    ... [set]
    ... scenario.duration_s = 5.0
    ... '''
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "short.toml").write_text(study)
    ...     made: Sweep = sweep(f"{folder}/short.toml", f"{folder}/out")
    ...     sorted(made.runs()["strategy"])
    ['cbba', 'remoras']
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
        """Numbers of runs planned, done, failed, censored and remaining."""
        from dataclasses import asdict

        return asdict(self._results.status())

    def runs(self) -> DataFrame:
        """Return a row per finished run: key, configuration, summary."""
        rows: DataFrame = self._results.runs()
        return rows

    def to_xarray(self) -> xarray.Dataset:
        """Return the metrics by scenario, varied keys and repeat, with units; ImportError without xarray."""
        frame, metrics = self.runs(), self._results.metrics
        keys = sorted({name for line in self._results.lines.values() for name in line["settings"]})
        for name in keys:  # a key that some configurations do not set
            frame[name] = frame[name].where(frame[name].notna(), "")
        names = [name for name in metrics if name in frame]
        data = frame.set_index(["scenario", *keys, "repeat"])[names].to_xarray()
        for name in names:
            data[name].attrs["units"] = metrics[name].unit
        return data

    def compare(self, *metrics: str | Metric, baseline: str | None = None) -> DataFrame:
        """Return a row per configuration and metric: mean, interval, difference to the baseline.

        ``metrics`` are fields of the summary, or your own, as ``"mine.py:MINE"`` or the object, from stored tables;
        without any, all of the study. ``baseline`` is a strategy, policy or ``"KEY=VALUE"``; None: of the study.
        Raises OutputError for an unknown name, or without finished run or stored tables; PluginError if your own fails.
        """
        from dataclasses import asdict

        import pandas as pd

        from missions.comparison import compare as compared

        return pd.DataFrame([asdict(row) for row in compared(self._results, metrics, baseline)])

    def plot(
        self, kind: str | Metric = "overview", metric: str | Metric = "mission_time_s", width_in: float | None = None
    ) -> CaptionedFigure:
        """Draw a figure of the sweep; its ``.caption`` has n, seeds and intervals.

        ``kind`` is differences, ranking, trade-off or overview; a metric or its chart; or your own. ``metric``, of
        differences or ranking, is as in ``compare``. ``width_in`` None is a column or page of a paper. Raises
        DrawingError for an unknown kind, nothing or several figures to draw; OutputError without a run or that metric.
        """
        from visualisation.sweeps import sweep_picture

        results, (ranked, asked) = self._results.naming([metric, kind])
        return sweep_picture(results, asked, ranked, width_in).shown()
