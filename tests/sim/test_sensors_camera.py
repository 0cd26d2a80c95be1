"""The camera's faults have the size and the direction that they should have."""

from dataclasses import replace

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.sensors.auto_exposure import Exposure
from sim.sensors.camera import MAX_SAMPLES, ExposureDrift, ImageSensor
from sim.sensors.hashed_noise import gaussian, noise_key
from sim.sensors.pixel_motion import pixel_motion
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.presets import HARSH, NOMINAL
from sim.sensors.sensor_errors import ImageNoise

CAMERA = PinholeCamera(80, 60, 70.0, 72.0, 39.0, 30.5)
RAYS = PixelRays(CAMERA)
STILL = SE3.identity()
assert HARSH.image is not None
HARSH_NOISE = HARSH.image
FAULTLESS = ImageNoise(0.0, 0.0, 0.0, 0.0, 0.01)


def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def test_pixel_motion_is_that_of_projected_points() -> None:
    """A small motion moves each pixel's point as projecting it before and after says."""
    depth = rng().uniform(1.0, 4.0, (60, 80)).astype(np.float32)
    T_start_end = SE3.exp([1e-3, -2e-3, 1.5e-3, 2e-3, 1e-3, -1.5e-3])
    points = CAMERA.back_project(depth.astype(np.float64)).reshape(-1, 3)
    moved = CAMERA.project(T_start_end.inverse() @ points) - CAMERA.project(points)
    motion = pixel_motion(depth, RAYS, T_start_end).reshape(2, -1).T
    assert np.abs(moved).max() > 0.1
    assert np.abs(motion - moved).max() < 0.003


def test_nothing_far_away_moves_with_a_turn_only() -> None:
    nowhere = np.full((60, 80), np.nan, np.float32)
    assert np.abs(pixel_motion(nowhere, RAYS, SE3.exp([0.1, 0.2, 0.3, 0, 0, 0]))).max() == 0
    turned = pixel_motion(nowhere, RAYS, SE3.exp([0, 0, 0, 0, 0.01, 0]))
    middle = turned[:, 30, 39]
    assert middle == pytest.approx([-0.7, 0.0], abs=1e-3)  # looking right moves all to the left


def test_a_perfect_camera_changes_nothing() -> None:
    sharp = rng().integers(0, 256, (60, 80, 3), np.uint8)
    sensor = ImageSensor.of(RAYS, FAULTLESS, rng())
    depth = np.ones((60, 80), np.float32)
    np.testing.assert_array_equal(sensor.expose(sharp, depth, STILL, 1.0, rng()), sharp)


def test_blur_is_the_mean_over_the_exposure() -> None:
    """An edge that moves by 8 pixels becomes a ramp of that width, centred on the edge."""
    sharp = np.zeros((60, 80, 1), np.uint8)
    sharp[:, 40:] = 200
    depth = np.full((60, 80), 2.0, np.float32)
    T_start_end = SE3.exp([8 * 2.0 / CAMERA.fx, 0, 0, 0, 0, 0])
    blurred = ImageSensor.of(RAYS, FAULTLESS, rng()).expose(sharp, depth, T_start_end, 0.0, rng())
    row = blurred[30, :, 0].astype(float)
    # The edge lies at 39.5; the mean over +-4 px of a step is a line.
    expected = np.clip((np.arange(80) - 39.5 + 4.0) / 8.0, 0, 1) * 200
    assert np.abs(row - expected).max() < 14
    assert row.sum() == pytest.approx(expected.sum(), rel=0.01)


@pytest.mark.parametrize(("noise", "deviation"), [(NOMINAL.image, 2.0), (HARSH.image, 4.0)])
def test_noise_at_mid_grey(noise: ImageNoise, deviation: float) -> None:
    only_noise = ImageNoise(noise.read_noise, noise.shot_noise, 0.0, 0.0, 0.0)
    grey = np.full((60, 80, 3), 128, np.uint8)
    depth = np.ones((60, 80), np.float32)
    image = ImageSensor.of(RAYS, only_noise, rng()).expose(grey, depth, STILL, 0.0, rng())
    error = image.astype(float) - 128
    assert error.std() == pytest.approx(deviation, rel=0.05)
    assert abs(error.mean()) < 0.1
    # Channels and neighbours are independent.
    assert abs(np.corrcoef(error[..., 0].ravel(), error[..., 1].ravel())[0, 1]) < 0.05
    assert abs(np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1]) < 0.05


@pytest.mark.parametrize("gain", [1.0, 2.0, 4.0])
def test_gain_multiplies_noise(gain: float) -> None:
    """The same grey level from a shorter exposure and a gain: less light, so more shot noise."""
    noise = ImageNoise(1.0, 0.0235, 0.0, 0.0, 0.008)
    grey = np.full((60, 80, 3), 128, np.uint8)
    depth = np.ones((60, 80), np.float32)
    sensor = ImageSensor.of(RAYS, noise, rng())
    image = sensor.expose(grey, depth, STILL, 0.0, rng(), Exposure(0.008 / gain, gain))
    error = image.astype(float) - 128
    assert error.std() == pytest.approx(np.hypot(gain, np.sqrt(gain * 0.0235 * 128)), rel=0.05)
    assert abs(error.mean()) < 0.1 * gain


def test_light_beyond_white_saturates() -> None:
    ramp = np.tile(np.arange(80, dtype=np.uint8)[None, :, None] * 3, (60, 1, 1))
    depth = np.ones((60, 80), np.float32)
    sensor = ImageSensor.of(RAYS, FAULTLESS, rng())
    image = sensor.expose(ramp, depth, STILL, 0.0, rng(), Exposure(0.04))
    np.testing.assert_array_equal(image, np.minimum(ramp.astype(int) * 4, 255))
    assert (image == 255).mean() > 0.7


@pytest.mark.parametrize("gamma", [0.5, 2.2])
def test_gamma_bends_every_grey_level(gamma: float) -> None:
    ramp = np.tile(np.arange(240, dtype=np.uint8)[None, :80, None] * 3, (60, 1, 1))
    depth = np.ones((60, 80), np.float32)
    sensor = ImageSensor.of(RAYS, replace(FAULTLESS, gamma=gamma), rng())
    image = sensor.expose(ramp, depth, STILL, 0.0, rng())
    np.testing.assert_array_equal(image, np.rint(255 * (ramp / 255) ** (1 / gamma)))


def test_vignetting_darkens_the_corners_by_its_share() -> None:
    noise = ImageNoise(0.0, 0.0, 0.2, 0.0, 0.0)
    white = np.full((60, 80, 1), 200, np.uint8)
    depth = np.ones((60, 80), np.float32)
    image = ImageSensor.of(RAYS, noise, rng()).expose(white, depth, STILL, 0.0, rng())
    assert image[0, 0, 0] == 160
    assert image[30, 40, 0] == 200


def test_exposure_wanders_slowly_and_by_its_deviation() -> None:
    times = np.linspace(0, 2000, 40_000)
    logs = []
    for seed in range(5):
        drift = ExposureDrift.draw(0.03, np.random.default_rng(seed))
        logs.append(np.log([drift.gain(t) for t in times]))
    logs = np.array(logs)
    assert logs.std() == pytest.approx(0.03, rel=0.15)
    assert np.abs(np.diff(logs, axis=1)).max() / (times[1] - times[0]) < 0.15


def test_the_same_generator_gives_the_same_picture() -> None:
    sharp = rng().integers(0, 256, (60, 80, 3), np.uint8)
    sensor = ImageSensor.of(RAYS, NOMINAL.image, rng())
    depth = np.ones((60, 80), np.float32)
    one, two = (sensor.expose(sharp, depth, STILL, 1.0, rng()) for _ in range(2))
    other = sensor.expose(sharp, depth, STILL, 1.0, np.random.default_rng(6))
    np.testing.assert_array_equal(one, two)
    assert (one != other).mean() > 0.5


@pytest.mark.kernel
def test_hashed_noise_is_nearly_normal() -> None:
    key = noise_key(rng())
    with np.errstate(over="ignore"):
        values = np.array([gaussian(key, i) for i in range(50_000)], np.float64)
    assert abs(values.mean()) < 0.02
    assert values.std() == pytest.approx(1.0, abs=0.02)
    assert (values**4).mean() == pytest.approx(3.0, abs=0.25)
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 0.02


def exposed_pixel_by_pixel(
    sensor: ImageSensor,
    sharp: np.ndarray,
    motion: np.ndarray,
    time_s: float,
    keys: list[np.uint64],
    exposure: Exposure,
) -> np.ndarray:
    """The obvious twin of `ImageSensor.expose`: one pixel after the other, in double precision."""
    height, width, channels = sharp.shape
    image = np.empty(sharp.shape)
    for row, column, channel in np.ndindex(height, width, channels):
        mx, my = motion[row, column].astype(float)
        count = min(1 + int(np.ceil(max(abs(mx), abs(my)))), MAX_SAMPLES)
        light = 0.0
        for sample in range(count):
            along = (sample + 0.5) / count - 0.5
            x = np.clip(column + along * mx, 0, width - 1)
            y = np.clip(row + along * my, 0, height - 1)
            x0, y0 = min(int(x), width - 2), min(int(y), height - 2)
            (a, b), (c, d) = sharp[y0 : y0 + 2, x0 : x0 + 2, channel].astype(float)
            top, bottom = a + (x - x0) * (b - a), c + (x - x0) * (d - c)
            light += (top + (y - y0) * (bottom - top)) / count
        light *= sensor.drift.gain(time_s) * sensor.vignette[row, column]
        # Before the amplifier, with read noise and with shot noise by the light collected.
        light *= exposure.exposure_s / sensor.noise.exposure_s
        deviation = np.sqrt(sensor.noise.read_noise**2 + sensor.noise.shot_noise * light)
        noisy = light + deviation * gaussian(keys[channel], row * width + column)
        seen = np.clip(exposure.gain * noisy / 255, 0, 1) ** (1 / sensor.noise.gamma)
        image[row, column, channel] = np.floor(255 * seen + 0.5)
    return image


@pytest.mark.kernel
@pytest.mark.filterwarnings("ignore:overflow")  # of the hash, without the compiler
@pytest.mark.parametrize(
    ("channels", "gamma", "exposure"),
    [
        (1, 1.0, Exposure(HARSH_NOISE.exposure_s)),
        (3, 1.0, Exposure(HARSH_NOISE.exposure_s)),
        (1, 0.85, Exposure(HARSH_NOISE.exposure_s)),
        (3, 2.2, Exposure(0.4 * HARSH_NOISE.exposure_s, 1.7)),
    ],
)
def test_exposure_is_that_of_the_obvious_twin(
    channels: int, gamma: float, exposure: Exposure
) -> None:
    """Up to rounding: float32 may fall on the other side of half a grey level."""
    camera = PinholeCamera(24, 18, 30.0, 31.0, 11.0, 9.5)
    sharp = rng().integers(0, 256, (18, 24, channels), np.uint8)
    depth = rng().uniform(0.3, 4.0, (18, 24)).astype(np.float32)
    depth[5:8, 3:9] = np.nan
    T_start_end = SE3.exp([0.06, -0.02, 0.03, 0.01, 0.02, -0.05])
    sensor = ImageSensor.of(PixelRays(camera), replace(HARSH_NOISE, gamma=gamma), rng())
    motion = np.moveaxis(pixel_motion(depth, PixelRays(camera), T_start_end), 0, -1)
    assert np.abs(motion).max() > 5
    assert np.abs(motion).min() < 0.5
    draw = rng()
    twin = exposed_pixel_by_pixel(
        sensor, sharp, motion, 1.5, [noise_key(draw) for _ in range(channels)], exposure
    )
    image = sensor.expose(sharp, depth, T_start_end, 1.5, rng(), exposure)
    assert np.abs(image - twin).max() <= 1
    assert (image != twin).mean() < 0.005
