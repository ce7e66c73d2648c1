"""The style-transfer systems, a file or a folder each."""
