"""Cloud agents (deliverable section 3.2): started for one robot and one run, leased, confined, reached through a_rep.

The engine that runs them is a port (`port.CloudAgentEngine`); ours runs local processes (`engine`).
"""
