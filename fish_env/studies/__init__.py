"""Studies: questions put to the model, answered with tables and pictures."""
