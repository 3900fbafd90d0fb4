"""What programs are and whether their transitions hold when run."""
