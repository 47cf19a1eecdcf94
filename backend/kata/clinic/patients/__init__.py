"""Patients: whom the clinic treats."""
