"""`./rapp demo`: the paper's voice-mail on real processes; robot, person and mail account may be real or not."""
