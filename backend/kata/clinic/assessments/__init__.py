"""Assessments: range of motion, pain and SPADI, as they were found on a day."""
