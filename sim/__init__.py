"""MuJoCo scenes, the robots in them, their sensors and their recordings, with the truth."""
