from pathlib import Path

import duckdb
import remoras

STUDY = """
[study]
name = "small"
scenario = "mapping-rendezvous"
policies = ["ack", "mps-ack"]
repeats = 3
[[channel]]
name = "bernoulli"
per = [0.1, 0.5]
[set]
scenario.duration_s = 60
"""
FARTHEST = """
    SELECT r.policy, r.per, t.vehicle, max(sqrt(t.x_m ** 2 + t.y_m ** 2)) AS farthest_m
    FROM 'small/runs/*/trajectories.parquet' t JOIN 'small/runs.parquet' r USING (key)
    GROUP BY ALL ORDER BY ALL
"""

if __name__ == "__main__":  # each worker process loads this script
    Path("small.toml").write_text(STUDY)
    results = remoras.sweep("small.toml", out="small", jobs=2)
    print(results.runs().groupby(["policy", "per"]).n_bytes.describe())
    print(duckdb.sql(FARTHEST))
