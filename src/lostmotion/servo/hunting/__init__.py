"""Hunting: what a closed loop does at rest, its limit cycles, maps of them, and certificates with a proof."""
