"""A benchmark suite of short runs, with two networks and unexpected speeds."""

SHORT = """
[suite]
name = "short"
grounds = ["mapping-patches"]
bound = "missions.mapping.rounds:rounds"
limit_s = 7200.0
repeats = 2

[set]
scenario.duration_s = 40.0

[[network]]
name = "alike"
set."channel.per" = 0.42

[[network]]
name = "measured"
set."channel.name" = "network"

[[unforeseen]]
name = "speeds"
set."uncertainty.speed_spread" = 0.3
"""
