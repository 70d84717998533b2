"""Analysis and filtering of measured signals: the groups a and b of programs of Krezelewski & Misiag, section 4.1.

Group a: stationarity, normality, probability density, correlation, spectra. Group b: filtering, smoothing and the
removal of slow components, each with what it does to amplitude and phase.
"""
