"""Scene files: what stands in a world, how it is lit, and where both robots go.

`docs/add_a_scene.md` explains every key with an example.
"""

from sim.scene.light import Light
from sim.scene.load import load_scene, parse_scene, scene_names
from sim.scene.part import MAX_HEAP_HEIGHT_M, Part
from sim.scene.paths import GroundPath, MavPath
from sim.scene.room import Room
from sim.scene.rubble import Rubble
from sim.scene.scene import Scene
from sim.scene.terrain import Terrain
from sim.scene.things import Debris, Shelves, Street

__all__ = [
    "MAX_HEAP_HEIGHT_M",
    "Debris",
    "GroundPath",
    "Light",
    "MavPath",
    "Part",
    "Room",
    "Rubble",
    "Scene",
    "Shelves",
    "Street",
    "Terrain",
    "load_scene",
    "parse_scene",
    "scene_names",
]
