"""Platform-motion observer: late, coarse sensors in; a smooth present pose out."""
