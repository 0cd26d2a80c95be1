"""What is set before anything runs: setups, settings, environment, console, published values."""
