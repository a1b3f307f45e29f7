"""HZ packages: what is in them, how they are packed, why they are believed, how they come to stand on a disk."""
