"""NAOqi modules, one file each; methods are named and behave as in NAOqi 2.1 (naoqi documentation, "NAOqi API")."""
