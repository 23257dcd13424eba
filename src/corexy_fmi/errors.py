"""The one exception for a user's mistake: the command line prints its line and exits with 2."""


class InputError(ValueError):
    """Bad input: one line that names the file, the place, what was found and what was expected."""
