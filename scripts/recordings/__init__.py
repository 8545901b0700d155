"""Commands on recordings: info, convert, record."""
