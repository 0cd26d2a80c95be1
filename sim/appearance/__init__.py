"""Generated textures of cardboard, floors and ground, with baked light."""
