"""Air-ground localization and map augmentation by 3D structure alone.

The pipeline of Forster, Pizzoli and Scaramuzza (IROS 2013): sensor data of a small
drone (MAV) and a ground robot in, their relative pose and one augmented map out.
"""

__version__ = "0.1.0"
