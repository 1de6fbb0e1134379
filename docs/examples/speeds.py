from remoras import Figure


def draw(axes, results, style):
    rows = results.table("trajectories").to_pylist()
    for vehicle, look in style.looks.items():
        own = [(row["time_s"], row["speed_mps"]) for row in rows if row["vehicle"] == vehicle]
        axes.plot(*zip(*own), color=look.colour, linestyle=look.line, label=vehicle)
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("speed", "m/s"))
    return "Speed through the water as each vehicle measures it."


SPEED = Figure("speed", "Speed over mission time", draw, needs=("trajectories",))
