"""Section VI: height maps, cost maps, and the particles that believe them."""
