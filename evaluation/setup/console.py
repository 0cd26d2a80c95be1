"""What the user sees of a command: the log, one line for an error, the exit code."""

from __future__ import annotations

import errno
import logging
import signal
import sys
from collections.abc import Callable
from types import FrameType

from airground.errors import AirgroundError

EXIT_OK = 0
EXIT_ERROR = 2
EXIT_INTERRUPTED = 130


class Terminated(KeyboardInterrupt):
    """SIGTERM: unwinds like Ctrl-C, so that half-written output is cleaned up."""


def start_logging(verbose: bool) -> None:
    """Send the log to stderr; `verbose` shows what is done at each step."""
    from rich.console import Console
    from rich.logging import RichHandler

    handler = RichHandler(console=Console(stderr=True), show_path=False, show_time=verbose)
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[handler], force=True)
    level = logging.DEBUG if verbose else logging.INFO
    for room in ("airground", "sim", "evaluation"):
        logging.getLogger(room).setLevel(level)


def run(command: Callable[[], int | None]) -> int:
    """Run a command; what a user can mend becomes one line on stderr and an exit code.

    Anything else that escapes is a bug and keeps its traceback.
    """
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        return command() or EXIT_OK
    except AirgroundError as error:
        print_error(str(error))
    except OSError as error:
        if error.errno is None:
            raise
        print_error(describe(error))
    except MemoryError:
        print_error("out of memory; a shorter recording or fewer --threads need less")
    except KeyboardInterrupt as interrupt:
        print_error("terminated" if isinstance(interrupt, Terminated) else "interrupted")
        return EXIT_INTERRUPTED
    finally:
        signal.signal(signal.SIGTERM, before)
    return EXIT_ERROR


def print_error(message: str) -> None:
    one_line = " ".join(message.split())
    print(f"airground: error: {one_line}", file=sys.stderr)


def describe(error: OSError) -> str:
    """The file and what is wrong with it."""
    what = "no space left on the disk" if error.errno == errno.ENOSPC else str(error.strerror)
    return f"{error.filename}: {what}" if error.filename is not None else what


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise Terminated
