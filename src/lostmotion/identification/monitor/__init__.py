"""Monitoring of a drive over its life."""
