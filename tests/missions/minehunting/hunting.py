"""The shipped contacts for tests: their tables, and runs of them with settings changed."""

from varied import Varied

CONTACTS = Varied("minehunting-contacts", "contacts.toml")
raw, written, hunted = CONTACTS.raw, CONTACTS.written, CONTACTS.flown
AMPLE = 'communication.modem="whoi-psk-5"'
"""A modem by which all strips of a view fit one packet."""
