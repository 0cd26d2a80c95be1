"""Pictures and exact depth of a world that stands still, from cameras anywhere in it.

This is the one place where axes are converted: MuJoCo's cameras (OpenGL) look along -z with
y up, ours (OpenCV) along +z with y down.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import TracebackType

import glcontext
import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.errors import AirgroundError

_OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0])
_COMPATIBILITY_PROFILE = 210
"""OpenGL 2.1. MuJoCo uses functions that a context of 3.1 or newer lacks."""
_MAX_DEVICES = 16
"""More EGL devices than one machine has."""


class Renderer:
    """Draws a world (`model` from `with_cameras`) from named pinhole cameras.

    A context manager; the context belongs to the thread that made it.

    Raises:
        AirgroundError: This machine cannot draw without a screen.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._scene = mujoco.MjvScene(self._model, maxgeom=self._model.ngeom + 100)
        self._option = mujoco.MjvOption()
        visual = self._model.vis.global_
        self._window = _open_context(visual.offwidth, visual.offheight)
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the graphics context."""
        self._window.make_current()
        self._context.free()
        self._window.free()

    def draw(
        self, camera: str, T_world_camera: SE3
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """What is seen at the pixels' centres.

        Returns:
            (height, width, 3) uint8 RGB, textures filtered and edges not (`smooth_edges` does
            that); and (height, width) float32 depth [m], NaN where there is nothing.
        """
        rect = self._render(camera, T_world_camera, coloured=True)
        picture = np.empty((rect.height, rect.width, 3), np.uint8)
        stored = np.empty((rect.height, rect.width), np.float32)
        mujoco.mjr_readPixels(picture, stored, rect, self._context)
        return np.ascontiguousarray(picture[::-1]), self._metric(stored[::-1])

    def place(self, poses: Mapping[str, SE3]) -> None:
        """Move bodies of the world, by name, to their poses in `world`."""
        for name, pose in poses.items():
            mocap = int(self._model.body_mocapid[self._model.body(name).id])
            self._data.mocap_pos[mocap] = pose.translation
            self._data.mocap_quat[mocap] = np.roll(pose.quaternion_xyzw(), 1)
        mujoco.mj_kinematics(self._model, self._data)

    def depth(self, camera: str, T_world_camera: SE3) -> NDArray[np.float32]:
        """The depth that `draw` returns, for about a quarter of the time: without textures."""
        rect = self._render(camera, T_world_camera, coloured=False)
        stored = np.empty((rect.height, rect.width), np.float32)
        mujoco.mjr_readPixels(None, stored, rect, self._context)
        return self._metric(stored[::-1])

    def _render(self, camera: str, T_world_camera: SE3, coloured: bool) -> mujoco.MjrRect:
        self._option.flags[mujoco.mjtVisFlag.mjVIS_TEXTURE.value] = int(coloured)
        index = self._model.camera(camera).id
        self._data.cam_xpos[index] = T_world_camera.translation
        self._data.cam_xmat[index] = (T_world_camera.rotation @ _OPENCV_FROM_OPENGL).ravel()
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED
        view.fixedcamid = index
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, view, everything, self._scene
        )
        width, height = (int(side) for side in self._model.cam_resolution[index])
        rect = mujoco.MjrRect(0, 0, width, height)
        self._window.make_current()
        mujoco.mjr_render(rect, self._scene, self._context)
        return rect

    def _metric(self, stored: NDArray[np.float32]) -> NDArray[np.float32]:
        """Undo the perspective of the depth buffer, which is 0 at the far plane."""
        near = np.float32(self._model.vis.map.znear * self._model.stat.extent)
        far = np.float32(self._model.vis.map.zfar * self._model.stat.extent)
        depth = (far * near / (far - near)) / (stored + near / (far - near))
        depth[stored == 0] = np.nan
        return depth


class _EglContext:
    """OpenGL without a screen, on the first device that offers it.

    MuJoCo's own EGL module does not import with the PyOpenGL that pyrender pins.
    `MUJOCO_EGL_DEVICE_ID` chooses the device.
    """

    def __init__(self) -> None:
        chosen = os.environ.get("MUJOCO_EGL_DEVICE_ID")
        devices = range(_MAX_DEVICES) if chosen is None else [int(chosen)]
        create = glcontext.get_backend_by_name("egl")
        errors = []
        for device in devices:
            try:
                self._context = create(
                    mode="standalone",
                    glversion=_COMPATIBILITY_PROFILE,
                    libgl="libGL.so.1",
                    libegl="libEGL.so.1",
                    device_index=device,
                )
                return
            except Exception as error:  # glcontext raises no subclass
                errors.append(error)
        raise errors[0]

    def make_current(self) -> None:
        self._context.__enter__()

    def free(self) -> None:
        self._context.__exit__(None, None, None)
        self._context.release()


def _open_context(width: int, height: int) -> _EglContext | mujoco.GLContext:
    """A current graphics context without a screen: EGL, or OSMesa where that is asked for."""
    try:
        if os.environ.get("PYOPENGL_PLATFORM") == "osmesa":
            from mujoco.osmesa import GLContext

            context = GLContext(width, height)
        else:
            context = _EglContext()
        context.make_current()
    except Exception as error:  # each backend has its own kinds
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise AirgroundError(
            f"cannot draw without a screen ({reason}); `airground doctor` says what is missing"
        ) from error
    return context


def draw_with(threads: int) -> None:
    """Limit the threads of Mesa's software renderer; call it before there is a renderer.
    They come beside the caller's, which waits for them, so one thread is the caller's."""
    os.environ.setdefault("LP_NUM_THREADS", str(threads if threads > 1 else 0))


def with_cameras(spec: mujoco.MjSpec, cameras: Mapping[str, PinholeCamera]) -> mujoco.MjModel:
    """Compile a world (left as it is) with cameras of exact intrinsics, by name.
    It is drawn with one sample per pixel, at the pixel's centre.
    """
    spec = spec.copy()
    for name, camera in cameras.items():
        spec.worldbody.add_camera(
            name=name,
            resolution=[camera.width, camera.height],
            sensor_size=[camera.width * 1e-3, camera.height * 1e-3],  # only the aspect counts
            focal_pixel=[camera.fx, camera.fy],
            principal_pixel=[
                camera.width / 2 - 0.5 - camera.cx,
                camera.height / 2 - 0.5 - camera.cy,
            ],
        )
    # No larger buffer than the largest camera, no multisampling, two triangles per face of a box.
    visual, quality = spec.visual.global_, spec.visual.quality
    visual.offwidth = max(c.width for c in cameras.values())
    visual.offheight = max(c.height for c in cameras.values())
    quality.offsamples, quality.numquads = 0, 1
    return spec.compile()
