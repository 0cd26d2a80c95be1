"""Shapes of a world: boxes, terrain and rocks, and rays against their surfaces."""
