"""Make a robot of plancurate from a vendor's URDF."""
