"""`./rapp up`, `say`, `listen`, `status`, `log`, `down`: a robot and a cloud that run every day, in a folder called home."""
