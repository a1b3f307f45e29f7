"""Drivers of robots: virtual effectors and receptors. Simulated and real NAO are the same driver at another address."""
