"""The simulated NAO's body standing in a room: model, physics in a process of its own, pictures from another."""
