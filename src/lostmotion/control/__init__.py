"""What controls a drive: references, with their derivatives."""
