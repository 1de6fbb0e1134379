"""Optional scenario features, one file each; see ``missions.feature``."""

import missions.scenarios  # noqa: F401  # whose tables must exist before features extend them

__all__: list[str] = []
