"""All processes of one robot under one roof: started in order, watched, ended in reverse order (no roslaunch)."""
