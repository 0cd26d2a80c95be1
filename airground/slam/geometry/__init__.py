"""Geometry of one or two images: poses, points and descriptors."""
