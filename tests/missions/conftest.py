"""Its presence lets the tests in the folders below import the small mission."""
