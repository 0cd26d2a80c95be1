"""What a user sees of a command: the log, one line for an error, the exit code.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | `check` gave the verdict "worse"; nothing else exits with it |
| 2 | wrong input, or a machine that cannot do it (disk full, out of memory); one line says what |
| 3 | `doctor` or `inspect` found something wrong in what was looked at |
| 70 | internal error: a defect of this program; one line names the log file to report |
| 130 | interrupted by Ctrl-C or terminated |
| 141 | whoever read the output closed it before the command had finished |
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import select
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import TextIO

from airground import __version__
from airground.errors import AirgroundError, InputError
from evaluation.setup.progress import stderr

EXIT_OK = 0
EXIT_WORSE = 1
EXIT_ERROR = 2
EXIT_FAULT_FOUND = 3
EXIT_INTERNAL = 70
"""EX_SOFTWARE of the BSD header sysexits.h."""
LONGEST_MESSAGE = 800
"""Characters of a message: some lines of a screen."""
EXIT_INTERRUPTED = 130
"""128 + SIGINT, as shells give it."""
EXIT_UNREAD = 141
"""128 + SIGPIPE."""


class Terminated(KeyboardInterrupt):
    """SIGTERM: unwinds like Ctrl-C, so that half-written output is cleaned up."""


def start_logging(verbose: bool, file: Path | None = None) -> None:
    """Send the log to stderr; `verbose` shows what is done at each step. A `file` is added to, with
    each step and its time; InputError if that is not possible."""
    from rich.logging import RichHandler

    handler: logging.Handler
    if stderr().is_terminal:
        handler = RichHandler(console=stderr(), show_path=False, show_time=verbose)
    else:
        # Rich breaks lines at 80 columns there, paths included.
        handler = logging.StreamHandler()
        moment = "%(asctime)s " if verbose else ""
        handler.setFormatter(logging.Formatter(f"{moment}%(levelname)-8s %(message)s"))
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[handler], force=True)
    level = logging.DEBUG if verbose else logging.INFO
    handler.setLevel(level)
    if file is not None:
        try:
            kept = logging.FileHandler(file, encoding="utf-8")
        except OSError as error:
            raise InputError(f"--log {file}: cannot be written: {error.strerror}") from None
        kept.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
        logging.getLogger().addHandler(kept)
        level = logging.DEBUG
    for room in ("airground", "sim", "evaluation"):
        logging.getLogger(room).setLevel(level)


def run(command: Callable[[], int | None], verbose: bool = False) -> int:
    """Run a command; an error becomes one line on stderr and an exit code.

    Args:
        command: Work to be done; returns its exit code, None for 0.
        verbose: Whether an internal error shows its traceback.
    """
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        return _written(command() or EXIT_OK)
    except AirgroundError as error:
        print_error(str(error))
        return EXIT_ERROR
    except BrokenPipeError as error:
        if not _unread(sys.stdout):  # some other pipe, as that of a process that died
            _report(error, verbose)
            return EXIT_INTERNAL
        _discard_stdout()
        return EXIT_UNREAD
    except MemoryError:
        print_error("out of memory; a shorter recording or fewer --threads need less")
        return EXIT_ERROR
    except KeyboardInterrupt as interrupt:
        return _interrupted(interrupt)
    except Exception as error:
        # An import of compiled code that is interrupted raises ImportError, from the interrupt.
        if isinstance(error.__cause__, KeyboardInterrupt):
            return _interrupted(error.__cause__)
        if isinstance(error, OSError) and error.errno is not None:
            print_error(describe(error))
            return EXIT_ERROR
        _report(error, verbose)
        return EXIT_INTERNAL
    finally:
        signal.signal(signal.SIGTERM, before)


def _written(code: int) -> int:
    """The exit code of a finished command, whose last output may find no reader any more."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_stdout()
    except OSError:
        _discard_stdout()
        raise
    return code


def _unread(stream: TextIO) -> bool:
    """Whether the stream is a pipe that nothing reads any more."""
    poll = select.poll()
    try:
        poll.register(stream.fileno(), 0)
    except (OSError, ValueError):
        return False
    return any(event & select.POLLERR for _, event in poll.poll(0))


def _interrupted(interrupt: KeyboardInterrupt) -> int:
    print_error("terminated" if isinstance(interrupt, Terminated) else "interrupted")
    return EXIT_INTERRUPTED


def print_error(message: str) -> None:
    """One readable line: a message may quote control characters of a file, or megabytes."""
    one_line = " ".join(message.split())
    if len(one_line) > LONGEST_MESSAGE:
        half = LONGEST_MESSAGE // 2
        one_line = f"{one_line[:half]} [...] {one_line[-half:]}"
    shown = "".join(letter if letter.isprintable() else "\ufffd" for letter in one_line)
    print(f"airground: error: {shown}", file=sys.stderr)


def describe(error: OSError) -> str:
    """The file and what is wrong with it."""
    what = "no space left on the disk" if error.errno == errno.ENOSPC else str(error.strerror)
    return f"{error.filename}: {what}" if error.filename is not None else what


def _report(error: Exception, verbose: bool) -> None:
    """Keep the traceback of an internal error in a file, and ask for a report in one line."""
    trace = "".join(traceback.format_exception(error))
    if verbose:
        print(trace, file=sys.stderr, end="")
    where = "the traceback that --verbose shows"
    with contextlib.suppress(OSError):
        descriptor, name = tempfile.mkstemp(prefix="airground-error-", suffix=".log")
        with os.fdopen(descriptor, "w", encoding="utf-8") as log:
            log.write(f"airground {__version__}\n{' '.join(sys.argv)}\n\n{trace}")
        where = str(Path(name))
    what = traceback.format_exception_only(error)[-1]
    print_error(f"internal error, please report it with {where}: {what}")


def _discard_stdout() -> None:
    """Keep the interpreter from writing to the closed pipe once more as it ends."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise Terminated
