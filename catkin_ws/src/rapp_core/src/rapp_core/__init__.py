"""The core agent, a_core: one per robot, fixed; owns the hardware, listens to the person, runs and destroys dynamic agents."""
