"""The policy study: exchange policies under packet loss, without a mission.

It imports nothing but `exchange` and its draws of losses. Names are promised to stay in `exchange.study.study`:
`ExchangeStudy`, `Workload`, `run`, `StudyRow`; that module needs NumPy, and Numba (extra `study`) for speed.
"""

__all__: list[str] = []
