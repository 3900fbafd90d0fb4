"""What a run was: its figures and pictures."""
