"""The office after a sea trial: conditions, corrections, the verdict at full load, and the forms that are filed."""
