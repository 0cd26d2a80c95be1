"""What others would use to find the MAV in the ground robot's map, on the same data as ours."""
