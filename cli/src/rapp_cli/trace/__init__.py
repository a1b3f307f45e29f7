"""`./rapp trace`: the last run as a UML sequence diagram, from what the agents have recorded."""
