"""A copy of the map, to restore when a correction proves wrong."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.arrays import F64, I8, I64
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap


@dataclass(frozen=True, eq=False)
class MapSnapshot:
    """What adjustment changes of a map.

    Attributes:
        states: States of the keyframes.
        sightings: `ids`, `pixels` and `inverse_depths` of the keyframes, which are replaced
            and never written to.
        positions, point_states: Positions and states of the points.
    """

    states: list[RigState]
    sightings: list[tuple[I64, F64, F64]]
    positions: F64
    point_states: I8

    @classmethod
    def of(cls, sparse_map: SparseMap) -> MapSnapshot:
        """The map as it is now."""
        keyframes = sparse_map.keyframes
        return cls(
            [keyframe.state for keyframe in keyframes],
            [(keyframe.ids, keyframe.pixels, keyframe.inverse_depths) for keyframe in keyframes],
            sparse_map.positions.copy(),
            sparse_map.states.copy(),
        )

    def sighting_count(self) -> int:
        """How often a point was seen."""
        return sum(len(ids) for ids, _, _ in self.sightings)

    def restore(self, sparse_map: SparseMap) -> None:
        """Undo; the map must have neither new keyframes nor new points since."""
        for n, keyframe in enumerate(sparse_map.keyframes):
            keyframe.state = self.states[n]
            keyframe.ids, keyframe.pixels, keyframe.inverse_depths = self.sightings[n]
        sparse_map.positions[:] = self.positions
        sparse_map.states[:] = self.point_states
