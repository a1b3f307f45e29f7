"""What the platform sees in a picture: doors, lamps, QR codes. Pure functions on OpenCV's arrays (blue, green, red)."""
