"""Patients of the clinic."""
