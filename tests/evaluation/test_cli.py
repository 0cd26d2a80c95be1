"""The command line as a user meets it: help, wrong words, errors, exit codes."""

from __future__ import annotations

import dataclasses
import errno
import logging
import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from airground.errors import InputError, RecordingError
from evaluation import cli
from evaluation.commands.options import Verb, in_range
from evaluation.setup import console

RUN_CLI = "from evaluation.cli import main; main()"


def exit_code(*words: str) -> object:
    with pytest.raises(SystemExit) as exit_:
        cli.main(words)
    return exit_.value.code


def one_error_line(capsys: pytest.CaptureFixture[str]) -> str:
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("airground: error: ")
    return lines[0]


def cpu_seconds(*words: str) -> float:
    """Processor time of one call in a fresh process; the wall clock depends on the neighbours."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", RUN_CLI, *words], capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def test_help_answers_within_half_a_second() -> None:
    assert min(cpu_seconds("--help") for _ in range(3)) < 0.5


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_explains_itself(
    verb: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    assert exit_code(verb, "--help") == 0
    said = capsys.readouterr().out
    first_line = (cli.verb_class(verb).__doc__ or "").splitlines()[0]
    assert first_line == cli.VERBS[verb][1]
    assert first_line in said
    shown = re.findall(r"^  (?:--([a-z-]+)|[A-Z]+|{[a-z,]+})(?:\s|$)", said, re.MULTILINE)
    assert len(shown) == len(dataclasses.fields(cli.verb_class(verb)))
    assert "verbose" in shown


@pytest.mark.parametrize("verb", cli.VERBS)
def test_help_fits_a_screen(
    verb: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    assert exit_code(verb, "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= 100
    monkeypatch.setenv("COLUMNS", "70")
    assert exit_code(verb, "-h") == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 70


@pytest.mark.parametrize("verb", cli.VERBS)
def test_a_verb_is_parsed_without_heavy_imports(verb: str) -> None:
    heavy = "{'numpy', 'mujoco', 'cv2', 'numba', 'open3d', 'pandas', 'matplotlib', 'pydantic'}"
    script = (
        "import sys; from evaluation import cli\n"
        f"cli.answer([{verb!r}, '--help'])\n"
        f"try: cli.parse({verb!r}, ['--no-such-option'])\n"
        "except SystemExit: pass\n"
        f"print(sorted({heavy} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == "[]"


def test_overview_names_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("--help") == 0
    said = capsys.readouterr().out
    assert all(verb in said for verb in cli.VERBS)
    assert exit_code() == console.EXIT_ERROR


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code("--version") == 0
    assert capsys.readouterr().out.startswith("airground 0.")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["simulat"], "did you mean simulate? known: simulate, render, inspect, export, run"),
        (["zzz"], "unknown verb 'zzz'; known: simulate"),
        (["doctor", "--thred", "2"], "--thred, 2; did you mean --threads? (see airground doctor"),
        (["doctor", "--zzz"], "Unrecognized options: --zzz (see"),
        (["doctor", "--log", "no_such_folder/log"], "--log no_such_folder/log: cannot be written"),
        (["simulate", "flat", "--out", "x", "--sensors", "good"], "'nominal'"),
        (["simulate", "flat", "--out", "x", "--seed", "a"], "--seed"),
        (["simulate", "flat", "--out", "x", "--sed", "1"], "--sed"),
        (["simulate", "flat"], "--out"),
        (["doctor", "--threads", "0"], "--threads 0: must be at least 1"),
        (["reproduce", "--out", "x", "--poses", "file"], "'slam'"),
        (["reproduce", "--out", "x", "--render", "--recordings", "y"], "--render"),
        (["reproduce", "--out", "x", "--quick", "--suite", "fast"], "--suite"),
        (["run", "a", "--out", "x", "--set", "protocol.trials=2"], "of: reproduce, sweep"),
        (["run", "--out", "x"], "give either RECORDING, or both --mav DIR and --ground DIR"),
        (["live", "--out", "x"], "RECORDING"),
        (["track", "no_such_folder", "--out", "x"], "no_such_folder: no such folder"),
    ],
)
def test_wrong_words_get_one_line(
    words: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert exit_code(*words) == console.EXIT_ERROR
    assert named in one_error_line(capsys)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["no_such_scene"], "indoor_a"),
        (["flat", "--seed", "-1"], "--seed -1: must be from 0"),
        (["flat", "--duration-s", "nan"], "--duration-s nan: must be at least 1"),
        (["flat", "--flight", "-2"], "--flight -2: must be at least 0"),
    ],
)
def test_simulate_refuses_what_it_cannot_record(
    words: list[str], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "recording"
    assert exit_code("simulate", *words, "--out", str(out)) == console.EXIT_ERROR
    assert named in one_error_line(capsys)
    assert list(tmp_path.iterdir()) == []


def test_a_log_keeps_every_step_and_is_added_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work() -> None:
        logging.getLogger("airground.somewhere").debug("a step")

    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    for _ in range(2):
        console.start_logging(verbose=False, file=tmp_path / "log")
        work()
    lines = (tmp_path / "log").read_text().splitlines()
    assert [line.split(" DEBUG ")[1] for line in lines] == 2 * ["airground.somewhere: a step"]


def test_an_existing_folder_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine").write_text("precious")
    for verb in (["simulate", "flat"], ["reproduce"]):
        assert exit_code(*verb, "--out", str(tmp_path)) == console.EXIT_ERROR
        assert "exists already" in one_error_line(capsys)
    assert (tmp_path / "mine").read_text() == "precious"


def without_reader(script: str, unbuffered: bool = False) -> tuple[int, bytes]:
    """Exit code and errors of a Python script whose standard output has no reader. It starts to
    write when its standard input ends, or sooner; what it writes is kept until it ends, unless it
    is `unbuffered`."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    environment |= {"PYTHONUNBUFFERED": "1"} if unbuffered else {}
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        process.stdin.close()
        return process.wait(), process.stderr.read()


class TestRun:
    """What becomes of a verb's errors."""

    def test_a_users_error_is_one_line(self, capsys: pytest.CaptureFixture[str]) -> None:
        def fail() -> None:
            raise RecordingError("flight1: mav0/cam0/data.csv line 7:\n  stamp 5 repeats")

        assert console.run(fail) == console.EXIT_ERROR
        assert one_error_line(capsys).endswith("line 7: stamp 5 repeats")

    def test_a_message_is_short_and_printable(self, capsys: pytest.CaptureFixture[str]) -> None:
        """Whatever it quotes of a file."""

        def fail() -> None:
            raise InputError("a.toml: \x1b[2J" + "x" * 100_000 + " is no number")

        assert console.run(fail) == console.EXIT_ERROR
        line = one_error_line(capsys)
        assert line.isprintable()
        assert len(line) < 1000
        assert line.startswith("airground: error: a.toml: ")
        assert line.endswith("is no number")

    def test_a_full_disk_names_the_file(self, capsys: pytest.CaptureFixture[str]) -> None:
        def fail() -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "results/a.png")

        assert console.run(fail) == console.EXIT_ERROR
        assert one_error_line(capsys) == (
            "airground: error: results/a.png: no space left on the disk"
        )

    @pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
    def test_interrupts_unwind(
        self, sent: int, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
    ) -> None:
        # A shell that runs the tests in the background has them ignore interrupts.
        inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
        request.addfinalizer(lambda: signal.signal(signal.SIGINT, inherited))
        cleaned = []

        def be_interrupted() -> None:
            try:
                signal.raise_signal(sent)
            finally:
                cleaned.append(True)

        before = signal.getsignal(signal.SIGTERM)
        assert console.run(be_interrupted) == console.EXIT_INTERRUPTED
        assert signal.getsignal(signal.SIGTERM) == before
        assert cleaned
        assert "interrupted" in one_error_line(capsys) or sent == signal.SIGTERM

    def test_an_import_that_is_interrupted_is_no_internal_error(
        self, capsys: pytest.CaptureFixture[str]
    ) -> None:
        def load() -> None:
            raise ImportError("initialization failed") from KeyboardInterrupt()

        assert console.run(load) == console.EXIT_INTERRUPTED
        assert one_error_line(capsys) == "airground: error: interrupted"

    @pytest.mark.parametrize("verbose", [False, True])
    def test_an_internal_error_keeps_its_traceback(
        self,
        verbose: bool,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        def fail() -> None:
            raise ZeroDivisionError("by what")

        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        assert console.run(fail, verbose) == console.EXIT_INTERNAL
        said = capsys.readouterr().err
        (log,) = tmp_path.iterdir()
        assert said.splitlines()[-1] == (
            f"airground: error: internal error, please report it with {log}: "
            "ZeroDivisionError: by what"
        )
        assert ("Traceback" in said) == verbose
        assert "in fail\n" in log.read_text()
        assert (
            len({console.EXIT_OK, console.EXIT_WORSE, console.EXIT_ERROR, console.EXIT_INTERNAL})
            == 4
        )

    def test_a_reader_that_has_seen_enough_is_no_error(self) -> None:
        script = f"import sys; sys.argv[1:] = ['--help']; {RUN_CLI}"
        assert without_reader(script) == (console.EXIT_OK, b"")

    @pytest.mark.parametrize(
        ("command", "expected"),
        [
            ("lambda: print('worse') or 1", 1),
            ("lambda: print('x' * 100_000) or print('y', flush=True) or 1", console.EXIT_UNREAD),
        ],
        ids=["finished", "cut off"],
    )
    def test_a_verdict_does_not_get_lost_with_its_reader(self, command: str, expected: int) -> None:
        script = (
            "import sys; from evaluation.setup import console; sys.stdin.read(); "
            f"sys.exit(console.run({command}))"
        )
        assert without_reader(script) == (expected, b"")

    def test_output_that_is_not_kept_is_cut_off_at_once(self) -> None:
        """As README.md says of PYTHONUNBUFFERED: help to `head -0` is no finished command."""
        script = f"import sys; sys.stdin.read(); sys.argv[1:] = ['--help']; {RUN_CLI}"
        assert without_reader(script, unbuffered=True) == (console.EXIT_UNREAD, b"")

    def test_the_pipe_of_another_process_is_no_reader(
        self,
        capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch,
        tmp_path: Path,
    ) -> None:
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

        def command() -> None:
            raise BrokenPipeError

        assert console.run(command) == console.EXIT_INTERNAL
        assert "internal error" in capsys.readouterr().err

    def test_the_verbs_exit_code_is_kept(self) -> None:
        assert console.run(lambda: 1) == 1
        assert console.run(lambda: None) == console.EXIT_OK


def test_in_range_refuses_what_is_no_number() -> None:
    assert in_range("--x", 2.0, low=1.0, high=2.0) == 2.0
    with pytest.raises(InputError, match="--x 3: must be from 1 to 2"):
        in_range("--x", 3.0, low=1.0, high=2.0)
    with pytest.raises(InputError, match="--x nan"):
        in_range("--x", float("nan"))


def test_a_verb_must_say_what_it_does() -> None:
    with pytest.raises(TypeError, match="abstract"):
        Verb()  # type: ignore[abstract]
