"""The simulated NAO's ears: isolated words with a probability each, by pocketsphinx in a process of its own."""
