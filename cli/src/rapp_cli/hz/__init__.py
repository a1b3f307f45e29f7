"""`./rapp hz`: packages as files."""
