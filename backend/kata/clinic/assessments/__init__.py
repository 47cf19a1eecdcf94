"""Assessments of one day: range of motion, pain and SPADI."""
