"""The core services: each one a sub-FSM of the core FSM's state s9 over virtual effectors and receptors (paper section III)."""
