"""A mission in the browser: ``solara run solara_app.py`` (extra ``viz``)."""

import solara
from matplotlib.figure import Figure
from mesa.visualization import Slider, SolaraViz, make_plot_component
from mesa.visualization.utils import update_counter

from remoras.mesa import MissionModel
from remoras.strategies import titles

WORKS, LOST = "tab:blue", "tab:red"


@solara.component
def Sea(model):  # noqa: N802  # a component of Solara
    """Areas, rally points and vehicles."""
    update_counter.get()
    figure = Figure(figsize=(6, 5), layout="constrained")
    axes = figure.subplots()
    for place in model.stepping.places:
        xs, ys = zip(*place.outline_m)
        axes.fill(xs, ys, facecolor="0.92", edgecolor="0.6")
        axes.plot(xs, ys, "x" if len(xs) == 1 else "-", color="0.6")
        axes.annotate(place.name, (min(xs), max(ys)), (3, -3), textcoords="offset points", va="top", color="0.4")
    for agent in model.agents:
        axes.plot(*agent.pos, "o", color=WORKS if agent.is_alive else LOST)
        axes.annotate(agent.name, agent.pos, (6, 4), textcoords="offset points")
    axes.set(aspect="equal", xlabel="east (m)", ylabel="north (m)")
    axes.set_title(f"{model.time_s:.0f} s, {model.goal_fraction:.0%} of the goal{', completed' * model.completed}")
    solara.FigureMatplotlib(figure)


@solara.component
def Beliefs(model):  # noqa: N802
    """Ages of the positions that each vehicle knows of the others, and its roles."""
    update_counter.get()
    figure = Figure(figsize=(6, 5), layout="constrained")
    axes = figure.subplots()
    names = [agent.name for agent in model.agents]
    axes.barh(names, [agent.belief_age_s for agent in model.agents], color="lightblue")
    for agent in model.agents:
        axes.annotate(agent.roles.replace(", ", "\n"), (0, agent.name), (4, 0), textcoords="offset points", va="center")
    axes.set(title="Age of beliefs, and roles", xlabel="mean age of known positions (s)", xlim=(0, None))
    axes.invert_yaxis()
    solara.FigureMatplotlib(figure)


parameters = {
    "scenario": "mapping-rendezvous",
    "per": Slider("loss", 0.3, 0.0, 0.95, 0.05),
    "strategy": {"type": "Select", "label": "strategy", "value": "remoras", "values": list(titles())},
    "seed": Slider("seed", 1, 1, 50, 1),
}
page = SolaraViz(
    MissionModel(per=0.3),
    components=[(Sea, 0), (Beliefs, 0), make_plot_component("belief_age_s")],
    model_params=parameters,
    play_interval=1,
    render_interval=20,  # ticks between drawings
    name="REMORAS",
)
page  # noqa: B018  # shown by Solara
