"""A benchmark suite of short runs, with two networks and unexpected speeds."""

SHORT = """
[suite]
name = "short"
scenario = "escort-lines"
bound = "missions.fieldwork.drawn_lines:rounds"
limit_s = 7200.0
repeats = 2

[set]
scenario.duration_s = 40.0
drawn_lines.number = 6

[[ground]]
name = "half"
set."drawn_lines.escorted_share" = 0.5

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
