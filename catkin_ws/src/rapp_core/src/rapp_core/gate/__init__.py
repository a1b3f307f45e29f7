"""The gate (DESIGN section 3.6): the only way out of a dynamic agent's sandbox.

One small process for each run, started and ended by the launcher. Towards the sandbox it is ROS master and publisher, towards the
robot's ROS a node; it lets through only the names that the RApp may use, under the run's own name and with the lease's secret.
"""
