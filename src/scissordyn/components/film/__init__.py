"""Oil in a joint: impedances of short, long and finite bearings, and the element that exerts their force."""
