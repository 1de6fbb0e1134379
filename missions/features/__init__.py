"""Features of scenarios, one file each: see ``missions.feature``. Nobody imports one by name but its tests."""

import missions.scenarios  # noqa: F401  # whose tables take in the keys of features, has to be there first

__all__: list[str] = []
