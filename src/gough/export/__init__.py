"""A platform written out for other programs: C for one machine, kinematics for LinuxCNC."""
