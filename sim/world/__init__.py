"""The MuJoCo world of a scene file and a seed."""
