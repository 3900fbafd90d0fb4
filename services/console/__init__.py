"""The console: one web page that shows the robot and asks it for things, live or from a log."""
