"""A simulated NAO: NAOqi modules over the qi protocol, voice and ears of its own, a body in a room. Knows nothing of RAPP."""
