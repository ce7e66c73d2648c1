"""The ground under the character: heights over the floor plane, made by rule or read from a picture."""
