"""Forward kinematics: from leg readings to poses that say how far they can be trusted."""
