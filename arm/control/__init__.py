"""The control basis: objectives composed by subject-to."""
