"""The physics: atmosphere, hinge moments, motion of the tab and aileron, and its linearisation."""
