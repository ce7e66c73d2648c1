"""The window's loop: input, session, drawing."""
