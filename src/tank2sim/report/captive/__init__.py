"""The page of a captive campaign."""
