"""Levels of difficulty: frozen and versioned settings, one TOML file each."""
