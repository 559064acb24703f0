"""A result for other tools: MCAP files of ROS 2 messages, tables. Loads their packages on use."""
