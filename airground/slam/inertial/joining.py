"""One inertial motion out of two that follow each other, without their samples.

Covariance and Jacobians are carried on by the chain rule as in the paper that `preintegration`
cites, Appendix A and B.
"""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.slam import so3
from airground.slam.inertial.preintegration import Preintegration


def join(first: Preintegration, second: Preintegration) -> Preintegration:
    """The motion from the start of `first` to the end of `second`, which begins where `first` ends.
    Free of the biases of `first`; those of `second` are brought there to first order."""
    turned, sped, moved = second.corrected(first.gyro_bias, first.accelerometer_bias)
    R, t = first.rotation, second.duration_s
    # What an error of the first motion's rotation, velocity and position does at the end.
    onward = np.eye(9)
    onward[0:3, 0:3] = turned.T
    onward[3:6, 0:3] = -R @ so3.hat(sped)
    onward[6:9, 0:3] = -R @ so3.hat(moved)
    onward[6:9, 3:6] = t * np.eye(3)
    # The second's velocity and position are in the axes of the rig between them.
    beyond = np.eye(9)
    beyond[3:6, 3:6] = beyond[6:9, 6:9] = R
    jacobian = onward @ first.by_biases() + beyond @ second.by_biases()
    return Preintegration(
        first.duration_s + t,
        _frozen(R @ turned),
        _frozen(first.velocity + R @ sped),
        _frozen(first.position + t * first.velocity + R @ moved),
        _frozen(jacobian[0:3, 0:3]),
        _frozen(jacobian[3:6, 0:3]),
        _frozen(jacobian[3:6, 3:6]),
        _frozen(jacobian[6:9, 0:3]),
        _frozen(jacobian[6:9, 3:6]),
        _frozen(onward @ first.covariance @ onward.T + beyond @ second.covariance @ beyond.T),
        first.gyro_bias,
        first.accelerometer_bias,
        float(np.hypot(first.gyro_bias_sigma, second.gyro_bias_sigma)),
        float(np.hypot(first.accelerometer_bias_sigma, second.accelerometer_bias_sigma)),
        max(first.longest_gap_s, second.longest_gap_s),
    )


def _frozen(array: F64) -> F64:
    array = np.ascontiguousarray(array)
    array.flags.writeable = False
    return array
