"""Captive model tests to hydrodynamic derivatives (papers 2: Krezelewski & Misiag; ITTC 7.5-02-06-02, -04)."""
