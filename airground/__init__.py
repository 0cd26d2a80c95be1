"""Air-ground localization and map augmentation by 3D structure alone.

The pipeline of Forster, Pizzoli and Scaramuzza (IROS 2013): sensor data of a small
drone (MAV) and a ground robot in, their relative pose and one augmented map out::

    import airground

    run = airground.run(airground.open_recording("recordings/a"))
    for event in run:
        if isinstance(event, airground.Aligned):
            print(event.alignment.T_ground_mav)
    cloud = run.augmented_map().cloud_ground

The names of this package, each loaded when it is first used:

- running: `open_recording`, `run`, `Run`, `Config`, `paper`, `Pipeline`, `AugmentedMap`
- events: `Event`, `MavTracked`, `GroundTracked`, `TrackingLost`, `SurfaceCast` (with an
  `AerialSurface`), `BeliefUpdated` (with a `Belief`), `Aligned` (with an `Alignment`),
  `MapAugmented`
- data: `SE3`, `PointCloud`, `Trajectory`, `PinholeCamera`, `Source` (MAV or GROUND)
- own robots: `slam_trackers`, `Trackers`, `FrontEnds`, `FrontEnd`, `TrackedPose`,
  `RobotCalibration`, `ImuNoise`, `Stamped`, `MavImage`, `GroundImage`, `ImuSamples`,
  `MagneticSamples`
- files: `Recording`, `Pair`, `RobotRecording`, `open_robot`, `write_ply`, `read_tum`, `write_tum`
- errors: `AirgroundError`, `InputError`, `RecordingError`, `ConfigError`
"""

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    # isort: off
    from airground.augmentation import AugmentedMap as AugmentedMap
    from airground.config import Config as Config, paper as paper
    from airground.core.belief import Alignment as Alignment, Belief as Belief
    from airground.core.camera import PinholeCamera as PinholeCamera
    from airground.core.cloud import PointCloud as PointCloud, Source as Source
    from airground.core.events import Aligned as Aligned, BeliefUpdated as BeliefUpdated
    from airground.core.events import Event as Event, GroundTracked as GroundTracked
    from airground.core.events import MapAugmented as MapAugmented, MavTracked as MavTracked
    from airground.core.events import SurfaceCast as SurfaceCast, TrackingLost as TrackingLost
    from airground.core.messages import GroundImage as GroundImage, ImuNoise as ImuNoise
    from airground.core.messages import ImuSamples as ImuSamples, MagneticSamples as MagneticSamples
    from airground.core.messages import MavImage as MavImage, RobotCalibration as RobotCalibration
    from airground.core.messages import Stamped as Stamped
    from airground.core.se3 import SE3 as SE3
    from airground.core.surface import AerialSurface as AerialSurface
    from airground.core.trajectory import Trajectory as Trajectory
    from airground.errors import AirgroundError as AirgroundError, ConfigError as ConfigError
    from airground.errors import InputError as InputError, RecordingError as RecordingError
    from airground.io.open_recording import open_recording as open_recording
    from airground.io.open_recording import open_robot as open_robot
    from airground.io.ply import write_ply as write_ply
    from airground.io.recording import Recording as Recording
    from airground.io.robot_recording import Pair as Pair, RobotRecording as RobotRecording
    from airground.io.tum import read_tum as read_tum, write_tum as write_tum
    from airground.pipeline import Pipeline as Pipeline
    from airground.run_recording import Run as Run, run as run, slam_trackers as slam_trackers
    from airground.slam.front_end import FrontEnd as FrontEnd, TrackedPose as TrackedPose
    from airground.tracking import FrontEnds as FrontEnds, Trackers as Trackers
    # isort: on

_NAMES = {
    "airground.augmentation": "AugmentedMap",
    "airground.config": "Config paper",
    "airground.core.belief": "Alignment Belief",
    "airground.core.camera": "PinholeCamera",
    "airground.core.cloud": "PointCloud Source",
    "airground.core.events": "Aligned BeliefUpdated Event GroundTracked "
    "MapAugmented MavTracked SurfaceCast TrackingLost",
    "airground.core.messages": "GroundImage ImuNoise ImuSamples "
    "MagneticSamples MavImage RobotCalibration Stamped",
    "airground.core.se3": "SE3",
    "airground.core.surface": "AerialSurface",
    "airground.core.trajectory": "Trajectory",
    "airground.errors": "AirgroundError ConfigError InputError RecordingError",
    "airground.io.open_recording": "open_recording open_robot",
    "airground.io.ply": "write_ply",
    "airground.io.recording": "Recording",
    "airground.io.robot_recording": "Pair RobotRecording",
    "airground.io.tum": "read_tum write_tum",
    "airground.pipeline": "Pipeline",
    "airground.run_recording": "Run run slam_trackers",
    "airground.slam.front_end": "FrontEnd TrackedPose",
    "airground.tracking": "FrontEnds Trackers",
}
"""The names of each module, as in the imports above; a test compares the two."""

_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names.split()}

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Load a name when it is first used (PEP 562), so that `import airground` stays fast."""
        if name not in _MODULE_OF:
            raise AttributeError(f"module 'airground' has no attribute '{name}'")
        value = getattr(import_module(_MODULE_OF[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *_MODULE_OF})
