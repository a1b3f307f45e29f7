"""a_rep: the platform in the cloud. A Tornado server of HOP services with the store of RApps (paper §III, deliverable §3)."""
