"""Generated pictures of cardboard, floors and ground, and baked light."""
