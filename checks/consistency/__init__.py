"""Consistency of the measurements of one unit; measurements that contradict each other have no result."""
