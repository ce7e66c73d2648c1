"""The character in a browser: a server, its workers, and the page."""
