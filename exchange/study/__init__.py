"""Policy study: exchange policies under packet loss, without a mission.

Depends on `exchange` and its loss draws only. Stable names are `ExchangeStudy` and `StudyLoad` in
`exchange.study.parameters`, `run` and `StudyRow` in `exchange.study.study`, which needs NumPy, and Numba (extra
`study`) for speed.
"""

__all__: list[str] = []
