"""Policy study: exchange policies under packet loss, without a mission.

Depends on `exchange` and its loss draws only. Stable names are in `exchange.study.study`: `ExchangeStudy`, `StudyLoad`,
`run`, `StudyRow`; that module needs NumPy, and Numba (extra `study`) for speed.
"""

__all__: list[str] = []
