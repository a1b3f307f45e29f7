"""The control subsystem c_core: the FSM of the paper's Fig. 2 and what its states do."""
