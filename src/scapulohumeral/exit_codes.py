"""What a command says at its end, and the exit code that goes with it."""

from __future__ import annotations

import sys
from collections.abc import Callable

from scapulohumeral.errors import (
    REFUSED,
    STOPPED,
    ConfigError,
    DataError,
    ModelError,
    StoppedError,
)

# Of a command that Ctrl-C ended, as shells have it.
INTERRUPTED = 130


def exit_code(command: Callable[[], int]) -> int:
    """Run a command; the code it returns, or that of a remedy its user has, with a message.

    Whatever else is raised is a defect of the program, and passes.
    """
    try:
        return command()
    except (ConfigError, DataError, ModelError) as error:
        print(f"Refused: {error}", file=sys.stderr)
        return REFUSED
    except StoppedError as error:
        print(f"Stopped: {error}", file=sys.stderr)
        return STOPPED
    except KeyboardInterrupt:
        print("Interrupted: there is no answer. Run the same again.", file=sys.stderr)
        return INTERRUPTED
