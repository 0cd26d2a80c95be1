"""The errors that are meant for users."""


class AirgroundError(Exception):
    """A problem that one line explains: what was wrong, where, and what would be right.
    The command line prints it without a traceback and exits non-zero. Anything else is a bug."""


class InputError(AirgroundError):
    """An input (a file, a key, a number) cannot be used."""


class RecordingError(InputError):
    """A recording on disk is missing something, is damaged, or contradicts itself."""


class ConfigError(InputError):
    """A parameter is unknown or out of its range."""
