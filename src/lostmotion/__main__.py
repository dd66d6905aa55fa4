"""``python -m lostmotion``."""

from .cli import main

main()
