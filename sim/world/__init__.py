"""A scene file and a seed become a MuJoCo world."""
