"""Section VII: alignment of the aerial cloud with the ground map by point-to-plane ICP."""

from airground.refinement.alignment import refine

__all__ = ["refine"]
