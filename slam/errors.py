"""The exception for invalid user input; any other exception is a bug."""


class InputError(ValueError):
    """Invalid user input; the message is one line that says what was expected."""
