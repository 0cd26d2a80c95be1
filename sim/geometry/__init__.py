"""Shapes of a world: boxes, terrain, rocks, surfaces, rays."""
