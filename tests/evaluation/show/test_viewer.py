"""What is opened, served and saved: on loopback only, whole, or refused in one line."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import urllib.request
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from airground.errors import AirgroundError, InputError
from evaluation import cli
from evaluation.commands.live import Live
from evaluation.commands.look import rerun_file
from evaluation.setup import console
from evaluation.show.rerun_view import viewer
from evaluation.show.rerun_view.run_view import RunView
from tests.evaluation.show.scripted_run import (
    CONFIG,
    LENSES,
    NAME,
    TIMES_NS,
    TRUTH,
    ReadBack,
    seen_events,
    show,
    written,
)

LISTEN = "0A"
LOOPBACK = {"0100007F", "00000000000000000000000001000000"}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    written(folder / "run.rrd")
    return folder


def listening(process: int) -> dict[int, str]:
    """Port and address (hexadecimal, as the kernel writes it) of a process's open sockets."""
    links = []
    for entry in Path(f"/proc/{process}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            links.append(os.readlink(entry))
    sockets = {link[8:-1] for link in links if link.startswith("socket:[")}
    found = {}
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == LISTEN and fields[9] in sockets:
                address, port = fields[1].split(":")
                found[int(port, 16)] = address
    return found


def test_a_file_passes_rerun_s_own_check_and_holds_its_layout(run: Path) -> None:
    viewer.verify(run / "run.rrd")
    assert len(RrdReader(run / "run.rrd").blueprints()) == 1


def test_a_broken_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / "run.rrd"
    broken.write_bytes(b"RRF2 but not really")
    with pytest.raises(SystemExit):
        cli.main(["view", str(tmp_path), "--serve"])
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert "run.rrd" in said[0]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_served_on_loopback_only(run: Path) -> None:
    ports = viewer.free_ports()
    with viewer.serving(ports, run / "run.rrd") as server:
        found = listening(server.pid)
        page = urllib.request.urlopen(f"http://{viewer.LOOPBACK}:{ports.web}/", timeout=10)
        assert b"<html" in page.read().lower()
    assert set(found) == {ports.web, ports.data}
    assert set(found.values()) <= LOOPBACK
    assert server.poll() is not None
    with socket.socket() as probe:
        assert probe.connect_ex((viewer.LOOPBACK, ports.web)) != 0


def test_nothing_calls_the_sdk_s_servers_which_listen_everywhere() -> None:
    package = Path(viewer.__file__).parent
    text = "".join(
        path.read_text() for path in (*package.glob("*.py"), *package.parent.glob("commands/*.py"))
    )
    for call in ("serve_grpc(", "serve_web_viewer(", "spawn(", "start_web_viewer_server("):
        assert call not in text


def test_taken_ports_are_left_alone() -> None:
    with socket.socket() as taken:
        taken.bind((viewer.LOOPBACK, 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert viewer._free_port(port) != port


def test_what_is_saved_is_the_same_run(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "sent.rrd"
    cli.parse("view", [str(run), "--save", str(out)]).main()
    saved, original = ReadBack(out), ReadBack(run / "run.rrd")
    assert saved.entities == original.entities
    for entity, component in (
        ("/mav/camera", "Transform3D:translation"),
        ("/mav/depth_map", "EncodedDepthImage:blob"),
        ("/events", "TextLog:text"),
    ):
        assert saved.values(entity, component) == original.values(entity, component)
    assert len(RrdReader(out).blueprints()) == 1
    with pytest.raises(InputError, match="exists already"):
        cli.parse("view", [str(run), "--save", str(out)]).main()
    assert [path.name for path in tmp_path.iterdir()] == ["sent.rrd"]


def test_a_run_without_a_file_says_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="run the recording again with --rerun"):
        rerun_file(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        rerun_file(tmp_path / "missing")


def test_without_a_screen_a_window_is_refused(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match="--serve shows it in a browser"):
        cli.parse("view", [str(run)]).main()


def test_a_viewer_that_is_closed_meanwhile_leaves_the_file_whole(tmp_path: Path) -> None:
    ports, file = viewer.free_ports(), tmp_path / "run.rrd"
    with viewer.serving(ports) as server:
        view = RunView(file, NAME, LENSES, TRUTH, CONFIG, TIMES_NS, "all", ports.sink)
        show(view, seen_events()[:8])
        server.kill()
        server.wait()
        show(view, seen_events()[8:])
        view.close()
    viewer.verify(file)
    assert ReadBack(file).values("/events", "TextLog:text")[-1] == ["MAV: lost"]


@pytest.mark.parametrize("verb", ["track", "live"])
def test_verbs_that_draw_nothing_have_no_rerun(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        cli.main([verb, "recording", "--rerun", "--out", str(tmp_path / "out")])
    assert "--rerun" in capsys.readouterr().err
    if verb == "live":  # its help says how to draw a live run
        assert "--drops DIR/dropped.json --rerun" in (Live.__doc__ or "")


def test_only_one_way_to_look(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        cli.main(["view", str(run), "--serve", "--save", "x.rrd"])
    assert exit_.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert "--save" in line
    assert "--serve" in line


def stand_in(folder: Path, then: str) -> Path:
    """A program in place of rerun's that listens on its --port, and then does something."""
    file = folder / "rerun"
    file.write_text(
        f"#!{sys.executable}\n"
        "import socket, sys, time\n"
        "port = int(sys.argv[sys.argv.index('--port') + 1])\n"
        "listening = socket.create_server(('127.0.0.1', port))\n"
        f"{then}\n"
    )
    file.chmod(0o755)
    return file


def test_a_viewer_that_listens_but_cannot_draw_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = stand_in(tmp_path, "time.sleep(0.3); sys.exit(102)")
    monkeypatch.setenv("RERUN_CLI_PATH", str(program))
    with (
        pytest.raises(AirgroundError, match=r"exit code 102 .* Vulkan"),
        viewer.window(viewer.free_ports()),
    ):
        pytest.fail("it does not draw")


def test_a_viewer_that_stays_is_let_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RERUN_CLI_PATH", str(stand_in(tmp_path, "time.sleep(60)")))
    monkeypatch.setattr(viewer, "STAY_S", 0.2)
    with viewer.window(viewer.free_ports()) as process:
        assert process.poll() is None
        process.terminate()
        process.wait()
