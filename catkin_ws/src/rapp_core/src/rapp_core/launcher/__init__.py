"""Life of a dynamic agent's process: a warm spare in a sandbox, activation, its channel, its end."""
