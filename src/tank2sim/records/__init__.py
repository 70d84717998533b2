"""What was measured: trials, captive campaigns, tows."""
