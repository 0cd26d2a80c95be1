"""Nominal values differ from true ones by the size of the preset, no more, no less."""

import numpy as np
import pytest

from airground.core.messages import USUAL_BIAS_MPS2
from airground.core.se3 import SE3
from airground.io.calibration import ImuTable
from sim.robots.robot_motion import Mounting
from sim.sensors.miscalibration import Calibrations, calibrate
from sim.sensors.presets import HARSH, NOMINAL, NONE, PAPER, SensorPreset
from sim.sensors.turned import with_noise

MAV = Mounting(
    SE3.from_heading(0.5, (0.0, 0.01, 0.02)), SE3.from_rotation_vector((3, 0.2, 0), (0.1, 0, 0))
)
GROUND = Mounting(SE3.identity(), SE3.from_rotation_vector((-1.5, 0, 0.1), (0, 0, 0.5)))


def drawn(preset: SensorPreset, seed: int = 0) -> Calibrations:
    return calibrate(420.0, MAV, GROUND, preset, np.random.default_rng(seed))


def test_without_errors_the_calibration_is_true() -> None:
    true, nominal = drawn(NONE).true, drawn(NONE).nominal
    assert (true.mav.camera, true.ground.camera) == (nominal.mav.camera, nominal.ground.camera)
    assert true.ground.depth == nominal.ground.depth
    for one, other in ((true.mav, nominal.mav), (true.ground, nominal.ground)):
        np.testing.assert_allclose(one.T_imu_camera, other.T_imu_camera, atol=1e-12)


@pytest.mark.parametrize("preset", [NOMINAL, HARSH, PAPER], ids=lambda preset: preset.name)
@pytest.mark.parametrize("robot", ["mav", "ground"])
def test_sizes_of_the_errors(preset: SensorPreset, robot: str) -> None:
    errors = preset.calibration
    assert errors is not None
    calibrations = drawn(preset)
    true, nominal = getattr(calibrations.true, robot), getattr(calibrations.nominal, robot)
    assert abs(nominal.camera.fx / true.camera.fx - 1) == pytest.approx(errors.focal)
    assert nominal.camera.fx == nominal.camera.fy
    turn = true.calibration().T_imu_camera.inverse() @ nominal.calibration().T_imu_camera
    assert turn.angle() == pytest.approx(errors.camera_to_imu)
    assert np.abs(turn.translation).max() < 1e-12
    assert nominal.T_body_imu == true.T_body_imu
    assert nominal.camera.time_offset_ns == 0
    assert abs(true.camera.time_offset_ns) == errors.time_offset_ns
    scale = (
        calibrations.true.ground.depth.units_per_m / calibrations.nominal.ground.depth.units_per_m
    )
    assert abs(scale - 1) == pytest.approx(errors.depth_scale)


@pytest.mark.parametrize("preset", [NOMINAL, HARSH, PAPER], ids=lambda preset: preset.name)
def test_the_nominal_calibration_states_how_large_its_errors_are(preset: SensorPreset) -> None:
    errors, noise, nominal = preset.calibration, preset.imu, drawn(preset).nominal
    assert errors is not None
    assert noise is not None
    for robot in (nominal.mav, nominal.ground):
        assert robot.calibration().accelerometer_bias_sigma == noise.accelerometer_bias
        sigmas = robot.calibration().sigmas
        assert sigmas.clock_s == pytest.approx(errors.time_offset_ns * 1e-9)
        # Three axes of this make a turn of the preset's size.
        assert sigmas.mounting_rad * np.sqrt(3) == pytest.approx(errors.camera_to_imu)
    assert nominal.ground.calibration().sigmas.depth_scale == errors.depth_scale


@pytest.mark.parametrize(
    ("factor", "stated"), [(0.0, USUAL_BIAS_MPS2), (1e-9, 1e-6), (1.0, 0.05), (30.0, 1.5)]
)
def test_a_calibration_can_be_written_whatever_the_noise(factor: float, stated: float) -> None:
    imu = drawn(with_noise(NOMINAL, factor)).nominal.mav.imu
    assert ImuTable.model_validate(imu.model_dump()) == imu
    assert imu.noise().accelerometer_bias_sigma == pytest.approx(stated)


def test_the_true_calibration_has_no_errors_to_state() -> None:
    for robot in (drawn(HARSH).true.mav, drawn(HARSH).true.ground):
        assert robot.mounting_sigma_rad is None
        assert robot.camera.time_offset_sigma_ns is None
        assert robot.imu.accelerometer_bias_sigma is None
    assert drawn(HARSH).true.ground.depth.scale_sigma is None


def test_harsh_is_three_times_nominal() -> None:
    assert NOMINAL.calibration is not None
    assert HARSH.calibration is not None
    for name, value in vars(NOMINAL.calibration).items():
        assert getattr(HARSH.calibration, name) == pytest.approx(3 * value), name


def test_signs_are_drawn_by_the_seed() -> None:
    clocks = {drawn(NOMINAL, seed).true.mav.camera.time_offset_ns for seed in range(20)}
    assert clocks == {-1_000_000, 1_000_000}
    assert drawn(NOMINAL, 3) == drawn(NOMINAL, 3)


def test_the_true_camera_is_the_one_of_the_scene() -> None:
    true = drawn(HARSH).true
    assert (true.mav.camera.fx, true.mav.camera.cx, true.mav.camera.cy) == (420.0, 375.5, 239.5)
    assert true.ground.calibration().camera.fx == 525.0
