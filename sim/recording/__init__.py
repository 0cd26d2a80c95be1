"""From a world and its robots to a recording on disk, with the truth."""
