"""The MAV: a quadrotor in MuJoCo, and the controller that flies it by its four rotors.

The model is an own one in the class of a 1 kg research quadrotor with 0.34 m between
opposite rotors. The controller is the geometric one on SE(3) of Lee, Leok and McClamroch
(CDC 2010).
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from sim.robots.robot_motion import GRAVITY_WORLD, Mounting

MASS_KG = 1.0
INERTIA = np.array([0.010, 0.011, 0.018])  # [kg m^2]
ARM_M = 0.12  # of a rotor from the body's axes (X configuration)
MAX_THRUST_N = 6.0
DRAG_TORQUE_M = 0.016  # yaw torque per newton of thrust
MOTOR_LAG_S = 0.025
FOOT_RADIUS_M = 0.01
FOOT_BELOW_M = 0.10  # of a foot's centre below the body's origin
REST_HEIGHT_M = FOOT_BELOW_M + FOOT_RADIUS_M
PHYSICS_STEP_S = 0.0025
# Gains of the controller on the errors of position [1/s^2] and velocity [1/s], and on those of
# attitude and its rate, per inertia.
STIFFNESS, DAMPING = 9.0, 5.0
ATTITUDE_STIFFNESS, ATTITUDE_DAMPING = 150.0, 20.0

# The camera looks straight down; its image's up (-y) is the body's forward (+x).
MOUNTING = Mounting(
    T_body_imu=(T_BODY_IMU := SE3.from_heading(np.pi / 2, (0.02, 0.01, -0.01))),
    T_imu_camera=T_BODY_IMU.inverse()
    @ SE3(np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]]), np.array([0.03, 0.0, -0.05])),
)

# x, y [m] of each rotor, and whether it turns clockwise (+1: yaw torque counter-clockwise).
_ROTORS = ((ARM_M, -ARM_M, -1), (ARM_M, ARM_M, 1), (-ARM_M, ARM_M, -1), (-ARM_M, -ARM_M, 1))
# Rows: thrust, roll, pitch and yaw torque made by a newton of each rotor.
_MIXER = np.array([[1.0, y, -x, spin * DRAG_TORQUE_M] for x, y, spin in _ROTORS]).T
_UNMIXER = np.linalg.inv(_MIXER)


def quadrotor_model(x: float, y: float, floor: float, heading: float) -> mujoco.MjModel:
    """The MAV standing on a level floor of height `floor` [m] at x, y [m], `heading` [rad].

    Sensors are `gyro` and `accelerometer` at the IMU; the state is that of a free joint.
    RK4 with lagging motors keeps forces continuous, so that what the IMU reads integrates
    to the path.
    """
    spec = mujoco.MjSpec()
    spec.option.timestep = PHYSICS_STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = GRAVITY_WORLD
    ground = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE)
    ground.size, ground.pos = [0, 0, 1], [0, 0, floor]
    half = 0.5 * heading
    body = spec.worldbody.add_body(
        name="mav",
        pos=[x, y, floor + REST_HEIGHT_M],
        quat=[np.cos(half), 0, 0, np.sin(half)],
        mass=MASS_KG,
        # Left out, MuJoCo 4.0 puts the centre of mass at `pos` again, in the body's frame.
        ipos=[0, 0, 0],
        iquat=[1, 0, 0, 0],
        inertia=INERTIA,
        explicitinertial=True,
    )
    body.add_freejoint()
    for index, (rotor_x, rotor_y, spin) in enumerate(_ROTORS):
        _add_rotor(spec, body, f"rotor{index}", rotor_x, rotor_y, spin)
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[FOOT_RADIUS_M, 0, 0],
            pos=[rotor_x, rotor_y, -FOOT_BELOW_M],
        )
    imu = MOUNTING.T_body_imu
    body.add_site(name="imu", pos=imu.translation, quat=np.roll(imu.quaternion_xyzw(), 1))
    for name, kind in (
        ("gyro", mujoco.mjtSensor.mjSENS_GYRO),
        ("accelerometer", mujoco.mjtSensor.mjSENS_ACCELEROMETER),
    ):
        spec.add_sensor(name=name, type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="imu")
    return spec.compile()


def _add_rotor(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, x: float, y: float, spin: int
) -> None:
    """A thruster: force along its site's z, drag torque about it, first-order lag."""
    body.add_site(name=name, pos=[x, y, 0.0])
    motor = spec.add_actuator(
        name=name,
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target=name,
        gear=[0, 0, 1, 0, 0, spin * DRAG_TORQUE_M],
        dyntype=mujoco.mjtDyn.mjDYN_FILTER,
        ctrllimited=True,
        ctrlrange=[0, MAX_THRUST_N],
    )
    motor.dynprm[0] = MOTOR_LAG_S


def rotor_thrusts(
    target: NDArray, heading: NDArray,
    position: NDArray, rotation: NDArray, velocity: NDArray, angular_velocity: NDArray,
) -> NDArray[np.float64]:  # fmt: skip
    """(4,) thrusts [N] that track a target by tilting the thrust (Lee et al., Eq. 12, 15, 16).

    Args:
        target: (3, 3) wanted position, velocity, acceleration in `world` [m, m/s, m/s^2].
        heading: (2,) wanted heading of the body's x axis [rad] and its rate [rad/s].
        position: (3,) position in `world` [m].
        rotation: (3, 3) body to world.
        velocity: (3,) velocity in `world` [m/s].
        angular_velocity: (3,) angular velocity in the body [rad/s].
    """
    force = MASS_KG * (
        STIFFNESS * (target[0] - position)
        + DAMPING * (target[1] - velocity)
        + target[2]
        - GRAVITY_WORLD
    )
    wanted = _attitude_for(force, heading[0])
    back = wanted.T @ rotation
    tilt_error = 0.5 * np.array(
        [back[2, 1] - back[1, 2], back[0, 2] - back[2, 0], back[1, 0] - back[0, 1]]
    )
    rate_error = angular_velocity - back.T[:, 2] * heading[1]
    spin = INERTIA * angular_velocity
    torque = -INERTIA * (
        ATTITUDE_STIFFNESS * tilt_error + ATTITUDE_DAMPING * rate_error
    ) + np.array(
        [
            angular_velocity[1] * spin[2] - angular_velocity[2] * spin[1],
            angular_velocity[2] * spin[0] - angular_velocity[0] * spin[2],
            angular_velocity[0] * spin[1] - angular_velocity[1] * spin[0],
        ]
    )
    wrench = np.array([force @ rotation[:, 2], *torque])
    return np.clip(_UNMIXER @ wrench, 0.0, MAX_THRUST_N)


def _attitude_for(force: NDArray, heading: float) -> NDArray[np.float64]:
    """(3, 3) attitude whose z axis is along `force` and whose x axis looks to `heading`."""
    up = force / np.sqrt(force @ force)
    cosine, sine = np.cos(heading), np.sin(heading)
    # up x (cosine, sine, 0)
    left = np.array([-up[2] * sine, up[2] * cosine, up[0] * sine - up[1] * cosine])
    left /= np.sqrt(left @ left)
    forward = np.array(
        [
            left[1] * up[2] - left[2] * up[1],
            left[2] * up[0] - left[0] * up[2],
            left[0] * up[1] - left[1] * up[0],
        ]
    )
    return np.column_stack([forward, left, up])
