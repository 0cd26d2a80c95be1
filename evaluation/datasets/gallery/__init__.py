"""A page that shows what a dataset has: images, paths, motion, overlap and light."""
