"""Front ends of others, to compare ours with: odometry of libraries, and files of poses."""
