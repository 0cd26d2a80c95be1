"""Where things lie in a recording, relative to its folder."""

HEADER = "recording.toml"
TRUTH = "truth"

MAV = "mav0"
MAV_CAMERA = "mav0/cam0"
MAV_CAMERA_LIST = f"{MAV_CAMERA}/data.csv"
MAV_IMAGES = f"{MAV_CAMERA}/data"
MAV_IMU = "mav0/imu0"
MAV_IMU_DATA = f"{MAV_IMU}/data.csv"
MAV_MAGNETOMETER = "mav0/mag0"
MAV_MAGNETOMETER_DATA = f"{MAV_MAGNETOMETER}/data.csv"

GROUND = "ground"
GROUND_COLOUR = "ground/rgb"
GROUND_DEPTH = "ground/depth"
GROUND_COLOUR_LIST = "ground/rgb.txt"
GROUND_DEPTH_LIST = "ground/depth.txt"
GROUND_ASSOCIATIONS = "ground/associations.txt"
GROUND_ACCELEROMETER = "ground/accelerometer.txt"
GROUND_IMU = "ground/imu0"
GROUND_IMU_DATA = f"{GROUND_IMU}/data.csv"
GROUND_MAGNETOMETER = "ground/mag0"
GROUND_MAGNETOMETER_DATA = f"{GROUND_MAGNETOMETER}/data.csv"

IMAGE_FOLDERS = (MAV_IMAGES, GROUND_COLOUR, GROUND_DEPTH)
