"""The arm: robot model, control basis, node types, programs."""
