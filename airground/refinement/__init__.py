"""Section VII: the aerial cloud is aligned with the ground robot's by point-to-plane ICP."""

from airground.refinement.alignment import refine

__all__ = ["refine"]
