"""The page of an audit of trials."""
