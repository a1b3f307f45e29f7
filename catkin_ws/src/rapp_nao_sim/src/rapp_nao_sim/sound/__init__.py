"""Sound in the simulated room: one sample clock, a microphone, a loudspeaker, people's voices, noise."""
