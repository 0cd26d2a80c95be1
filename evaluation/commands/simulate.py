"""`airground simulate`: a recording of one flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import Positional, arg

from evaluation.commands.words import OutWord, SeedWord, SensorWord, Verb, in_range


@dataclass(frozen=True, kw_only=True)
class Simulate(Verb, SensorWord, SeedWord, OutWord):
    """Record what the robots' sensors see in a scene.

    Drops the boxes, flies and drives both robots, renders their cameras, and keeps the truth
    apart in truth/. The recording opens in tools that read EuRoC and TUM RGB-D.
    """

    scene: Annotated[Positional[str], arg(metavar="SCENE")]
    """A scene that comes with the package (an unknown name lists them), or a .toml file."""
    flight: int = 0
    """Which flight over the same heap: moves the waypoints a little, draws other noise."""
    duration_s: Annotated[
        float | None, arg(metavar="S", help_behavior_hint="(default: the scene's own)")
    ] = None
    """Stop recording after this time."""

    def main(self) -> None:
        from evaluation.output import check_free
        from sim.presets import sensor_preset
        from sim.recorder import record
        from sim.scene import load_scene

        check_free(self.out)
        if self.duration_s is not None:
            in_range("--duration-s", self.duration_s, low=1.0)
        record(
            load_scene(self.scene),
            self.checked_seed(),
            sensor_preset(self.sensors),
            self.out,
            self.duration_s,
            self.workers(),
            flight=int(in_range("--flight", self.flight)),
        )
