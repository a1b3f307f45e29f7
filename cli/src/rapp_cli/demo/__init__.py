"""`./rapp demo`: stories on real processes; robot, person and mail account may be real or not."""
