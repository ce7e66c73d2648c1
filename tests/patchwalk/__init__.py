"""Tests of the library's front door and of the examples."""
