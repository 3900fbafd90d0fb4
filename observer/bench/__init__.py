"""How good the observer is: a seeded planar world, references, baselines, figures."""
