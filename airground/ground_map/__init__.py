"""The ground robot's map from RGB-D frames and their poses (Sec. IV)."""

from airground.ground_map.fixed_map import FixedMap
from airground.ground_map.fused_map import GroundMap

__all__ = ["FixedMap", "GroundMap"]
