"""The platform: behaviours that vote, and the arbiter that fuses them."""
