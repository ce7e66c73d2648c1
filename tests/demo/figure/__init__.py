"""Tests of demo.figure."""
