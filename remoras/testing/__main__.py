"""Let a plug-in be tried by its name: ``python -m remoras.testing KIND NAME``."""

import sys
from pathlib import Path

from exchange.errors import ExchangeError
from missions.errors import MissionsError
from remoras.errors import RemorasError
from remoras.plugins import drop_current_folder, look_in
from remoras.testing import KINDS, conforms


def main(arguments: list[str]) -> int:
    """Try one plug-in; 0 if it passes, 1 if it does not, 2 if there is none."""
    if len(arguments) != 2 or arguments[0] not in KINDS:
        print(f"usage: python -m remoras.testing {'|'.join(KINDS)} NAME", file=sys.stderr)
        return 2
    try:
        for passed in conforms(*arguments):
            print(f"ok  {passed}", flush=True)
    except AssertionError as error:
        print(f"{arguments[0]} {arguments[1]} does not conform: {error}", file=sys.stderr)
        return 1
    except ModuleNotFoundError as error:
        if error.name != "hypothesis":
            raise
        print('the checks of a strategy need Hypothesis: pip install "remoras-sim[authors]"', file=sys.stderr)
        return 2
    except (RemorasError, MissionsError, ExchangeError) as error:
        print(f"{arguments[0]} {arguments[1]}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    drop_current_folder()
    look_in([str(Path.cwd())])
    sys.exit(main(sys.argv[1:]))
