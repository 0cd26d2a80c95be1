"""Section V: depth maps from many close views, fused into a surface."""
