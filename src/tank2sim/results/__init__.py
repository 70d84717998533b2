"""Results of the core's commands: each declares its findings, key figures, tables and charts once."""
