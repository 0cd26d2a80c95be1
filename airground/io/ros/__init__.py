"""ROS 1 and ROS 2 bags, read as recordings of one robot."""
