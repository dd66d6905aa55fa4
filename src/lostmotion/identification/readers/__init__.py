"""Log files of all formats, each read by its library as channels over time."""
