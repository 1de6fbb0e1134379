"""An independent reading of results: what of a folder does not follow from its tables and its scenario.

Nothing here imports anything of ours. What should follow is worked out from docs/howto/results.md and docs/model/.
"""

__all__: list[str] = []
