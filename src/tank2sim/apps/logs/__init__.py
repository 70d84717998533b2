"""Logs that a vessel kept of itself: read, joined on one clock, understood, and cut into trials.

From the file to the trial: a reader of the format gives streams (:mod:`.streams`), each with its time in UTC;
:mod:`.clock` repairs and reports what is wrong with their times; :mod:`.channel_search` finds which stream is which
quantity; :mod:`.voyage` holds them in SI; :mod:`.stretches` finds manoeuvres; :mod:`.trial_files` writes them as
trials.
"""
