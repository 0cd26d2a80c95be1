"""The ground robot's map from RGB-D frames and their poses (Sec. IV)."""

from airground.ground_map.fused_map import FixedMap, GroundMap

__all__ = ["FixedMap", "GroundMap"]
