"""What every format has in common: whole or absent, the same bytes, clear refusals."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airground.errors import InputError, RecordingError
from airground.io.digests import file_digest
from evaluation.cli import main, parse
from evaluation.datasets.formats import FORMATS, robots_for
from evaluation.datasets.simulated import Simulated
from tests.io.recordings import write_recording


def contents(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): file_digest(path)
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_recording_gives_the_same_bytes(
    name: str, simulated: Simulated, exported, tmp_path: Path
) -> None:
    again = Simulated.open(simulated.recording.path)
    FORMATS[name].write(tmp_path, again, robots_for(name, None))
    assert contents(tmp_path) == contents(exported(name))


@pytest.mark.parametrize("name", FORMATS)
def test_the_expected_size_of_an_export_is_about_that_of_its_images(
    name: str, simulated: Simulated, exported
) -> None:
    robots, folder = robots_for(name, None), exported(name)
    large = [path for path in folder.rglob("*") if path.suffix in (".png", ".mcap", ".tar")]
    size_mb = sum(path.stat().st_size for path in large) / 1e6
    assert FORMATS[name].expected_mb(simulated, robots) == pytest.approx(size_mb, rel=0.1)


def test_a_point_for_colmap_states_how_far_its_pixels_are_off(exported) -> None:
    folder = exported("colmap") / "sparse" / "0"
    lines = [line.split() for line in (folder / "points3D.txt").read_text().splitlines()[1:]]
    errors_px = np.array([float(line[7]) for line in lines])
    assert 0 < errors_px.mean() < 1e-3
    # The first point, projected anew by what the files say.
    cameras = {
        line.split()[0]: [float(word) for word in line.split()[4:8]]
        for line in (folder / "cameras.txt").read_text().splitlines()[1:]
    }
    images = (folder / "images.txt").read_text().splitlines()[1:]
    off = []
    for image_id, position in zip(lines[0][8::2], lines[0][9::2], strict=True):
        pose, pixels = (images[2 * int(image_id) - 2 + i].split() for i in range(2))
        w, x, y, z, *translation = map(float, pose[1:8])
        point = np.array(lines[0][1:4], float)
        x, y, z = Rotation.from_quat([x, y, z, w]).apply(point) + translation
        fx, fy, cx, cy = cameras[pose[8]]
        place = 3 * int(position)
        seen = np.array(pixels[place : place + 2], float)
        off.append(np.linalg.norm(seen - [fx * x / z + cx, fy * y / z + cy]))
    assert errors_px[0] == pytest.approx(np.mean(off), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "robot", "why"),
    [
        ("tum", "mav", "every image needs its depth"),
        ("tum", "both", "every image needs its depth"),
        ("euroc", "ground", "has no depth images"),
        ("nerfstudio", "both", "give --robot mav or --robot ground"),
    ],
)
def test_what_a_format_cannot_hold_is_refused(name: str, robot: str, why: str) -> None:
    with pytest.raises(InputError, match=f"--robot {robot}: not with --format {name}: .*{why}"):
        robots_for(name, robot)


def test_a_changed_recording_is_not_handed_on(tmp_path: Path) -> None:
    recording = write_recording(tmp_path / "recording")
    first, second = sorted((recording / "ground" / "rgb").iterdir())[:2]
    second.write_bytes(first.read_bytes())
    with pytest.raises(RecordingError, match="ground/rgb: differs from what was recorded"):
        Simulated.open(recording)


def test_a_recording_without_truth_is_not_handed_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = write_recording(tmp_path / "recording")
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as exit_:
        main(["export", str(recording), "--format", "tum", "--out", str(out)])
    assert exit_.value.code == 2
    assert "has no truth" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["recording"]


def test_the_table_and_the_command_know_the_same_formats() -> None:
    for name in FORMATS:
        verb = parse("export", ["recording", "--format", name, "--out", "out"])
        assert verb.format == name  # type: ignore[attr-defined]


def test_plain_folders_are_distinguished_from_recordings(tmp_path: Path) -> None:
    (tmp_path / "rgb.txt").touch()
    with pytest.raises(InputError, match="only recordings that simulate has written"):
        Simulated.open(tmp_path)
