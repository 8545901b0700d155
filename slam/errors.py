"""The one kind of error that is a user's mistake and not a bug."""


class InputError(ValueError):
    """What the user gave cannot be used; the message is one line that says what was expected."""
