"""The link between trackers and mapper: tracked frames as messages over a socket."""
