"""What a servo engineer reads off a closed loop, and the gains that rules, margins or a search give it."""
