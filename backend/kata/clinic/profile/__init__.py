"""The clinic's own data: the head of its printed reports and its time zone."""
