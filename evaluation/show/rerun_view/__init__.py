"""A run as a recording of rerun: every stage, in sensor time.
Entities under `/truth` need the ground truth, which no robot has. Each class here is an onlooker of
a run that draws its part on one `SensorStream`."""
